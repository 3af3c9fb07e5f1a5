// Numbers that are not finite, in states and errors.
#pragma once

#include <cmath>
#include <span>

namespace sim {

bool all_finite(std::span<const double> values);

// The larger of two errors; not a number is the largest, whichever comes first.
inline double larger_error(double a, double b) { return a > b || std::isnan(a) ? a : b; }

}  // namespace sim
