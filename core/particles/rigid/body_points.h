// Points of rigid bodies in place of particles, for forces and constraints between particles.
#pragma once

#include <memory>
#include <vector>

#include "core/particles/constraint.h"
#include "core/particles/force.h"
#include "core/particles/rigid/rigid_body.h"

namespace sim {

// `force` and `constraint` join the nodes 0, 1, ..., which they see as their particles.
std::unique_ptr<Force> force_on_nodes(std::unique_ptr<Force> force, std::vector<JointNode> nodes);
std::unique_ptr<Constraint> constraint_on_nodes(std::unique_ptr<Constraint> constraint,
                                                std::vector<JointNode> nodes);

}  // namespace sim
