// Tests whether a state is finite.
#pragma once

#include <span>

namespace sim {

bool all_finite(std::span<const double> values);

}  // namespace sim
