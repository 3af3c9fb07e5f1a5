// Crossings of triangles by a look at all pairs: code of its own, to check surfaces by.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/math/vec3.h"

namespace sim_test {

// Pairs of an edge and a triangle without a common corner that pass through each other.
std::int64_t all_crossings(const std::vector<sim::Vec3>& places,
                           const std::vector<std::array<int, 3>>& triangles);

}  // namespace sim_test
