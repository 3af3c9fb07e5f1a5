// The order of elimination of particles and the multipliers of their constraints.
#pragma once

#include <vector>

#include "core/linear/sparse.h"
#include "core/particles/constraints/constraints.h"

namespace sim {

// Unknowns of a saddle point system [A J^T; J 0]: three of each free particle, and one of each row
// of J that acts on a free particle. Particles are in an order of little fill, and each row follows
// the last of its particles, so that chains and trees have no fill and no pivot is 0.
struct SaddleOrder {
  std::vector<int> particle_at, row_at;  // the first unknown of each; -1: it has none
  int unknowns = 0;
};

// pairs: the particles that A couples, besides those that share a row.
SaddleOrder saddle_order(const Constraints& constraints, BlockPairs pairs);

}  // namespace sim
