// Points under the surface of a rigid shape, which represent it to a fluid.
#pragma once

#include <vector>

#include "core/particles/rigid/rigid_body.h"

namespace sim {

// `depth` below the surface, about `width` apart and no hole wider than that, m, in the frame of
// the shape. Throws Error{kScene} if the shape is not thicker than twice the depth.
std::vector<Vec3> sample_boundary(const RigidShape& shape, double depth, double width);

double surface_area(const RigidShape& shape);  // m^2; of a compound the sum of its parts

}  // namespace sim
