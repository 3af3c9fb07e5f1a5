// Integers as indices of lists.
#pragma once

#include <cstddef>

namespace sim {

constexpr std::size_t slot(int i) { return static_cast<std::size_t>(i); }

}  // namespace sim
