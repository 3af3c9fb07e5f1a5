// Narrow phase of two boxes.
#pragma once

#include <vector>

#include "manifold_point.h"
#include "placed.h"

namespace sim {

void collide_boxes(const Placed& a, const Placed& b, double margin,
                   std::vector<ManifoldPoint>& out);

}  // namespace sim
