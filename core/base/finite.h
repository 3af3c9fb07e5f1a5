// Whether a state is still made of numbers.
#pragma once

#include <span>

namespace sim {

bool all_finite(std::span<const double> values);

}  // namespace sim
