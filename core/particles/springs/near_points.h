// Springs that are about to collapse to a point.
#pragma once

#include "core/particles/springs/springs.h"
#include "core/particles/view.h"

namespace sim {

// Calls visit(a, b, k, rest) for every spring that straight lines take below `share` of its rest
// length within `ahead` s, and for a few others; in any order.
void visit_near_points(const Springs& springs, const ParticleView& p, double ahead, double share,
                       const Springs::Visit& visit);

}  // namespace sim
