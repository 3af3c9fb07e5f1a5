// The median of some values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sim {

// The one in the middle, the larger of two; of at least one value.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace sim
