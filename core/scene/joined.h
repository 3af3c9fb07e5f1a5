// What a part of a scene joins: particles, or nodes where points of bodies are among them.
#pragma once

#include <vector>

#include "core/particles/rigid/points.h"
#include "core/scene/scene_spec.h"

namespace sim {

struct Joined {
  // of: elements of a scene of n particles, which outlive it.
  Joined(const Elements& of, const SystemSpec& spec, int n);
  Joined(const Joined&) = delete;

  Elements own;              // of nodes, where there are any
  const Elements& elements;  // these, or those of particles
  std::vector<Node> nodes;   // empty: all are particles
  int count;                 // of what the elements may join
};

}  // namespace sim
