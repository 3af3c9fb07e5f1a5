// The attachments of a part of a scene: particles, or nodes if points of bodies are among them.
#pragma once

#include <span>
#include <vector>

#include "core/particles/rigid/body_points.h"
#include "core/scene/scene_spec.h"

namespace sim {

struct BodyAttachments {
  // of: elements of a scene of n particles and these bodies; they outlive it.
  BodyAttachments(const Elements& of, const SystemSpec& spec, std::span<const RigidBody> bodies,
                  int n);
  BodyAttachments(const BodyAttachments&) = delete;

  Elements own;                  // of nodes, where there are any
  const Elements& elements;      // these, or those of particles
  std::vector<JointNode> nodes;  // empty: all are particles
  int count;                     // of the points that elements may join
};

}  // namespace sim
