// What a part of a scene joins: particles, or nodes where points of bodies are among them.
#pragma once

#include <span>
#include <vector>

#include "core/particles/rigid/points.h"
#include "core/scene/scene_spec.h"

namespace sim {

struct Joined {
  // of: elements of a scene of n particles and these bodies; they outlive it.
  Joined(const Elements& of, const SystemSpec& spec, std::span<const RigidBody> bodies, int n);
  Joined(const Joined&) = delete;

  Elements own;                  // of nodes, where there are any
  const Elements& elements;      // these, or those of particles
  std::vector<JointNode> nodes;  // empty: all are particles
  int count;                     // of what the elements may join
};

}  // namespace sim
