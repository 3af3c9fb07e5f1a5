// A point or direction in space, in SI units where it has any.
#pragma once

#include <Eigen/Core>

namespace sim {

using Vec3 = Eigen::Vector3d;

}  // namespace sim
