// Points of rigid bodies in place of particles, for forces and constraints between particles.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/particles/constraint.h"
#include "core/particles/force.h"

namespace sim {

// A particle, or a point of a body: a weighted sum of particles, with constant weights that add up
// to 1. A force on the point acts on each of them by its weight, with the same work and the same
// moment.
struct JointNode {
  int count = 0;  // of particles, 1 or 4
  std::array<int, 4> ids{};
  std::array<double, 4> weights{};
};

// `force` and `constraint` join the nodes 0, 1, ..., which they see as their particles.
std::unique_ptr<Force> force_on_nodes(std::unique_ptr<Force> force, std::vector<JointNode> nodes);
std::unique_ptr<Constraint> constraint_on_nodes(std::unique_ptr<Constraint> constraint,
                                                std::vector<JointNode> nodes);

}  // namespace sim
