// Two boxes that touch.
#pragma once

#include <vector>

#include "core/particles/body_geometry.h"
#include "placed.h"

namespace sim {

void touching_boxes(const Placed& a, const Placed& b, double margin, std::vector<TouchPoint>& out);

}  // namespace sim
