#include "core/base/finite.h"

#include <cstddef>

namespace sim {

// 0 * value is 0 for every finite value and nan otherwise.
bool all_finite(std::span<const double> values) {
  const std::size_t whole = values.size() / 8 * 8;
  double all = 0;
  for (std::size_t i = whole; i < values.size(); ++i) all += 0 * values[i];
  if (whole > 0) {
    double sum[8] = {};
    for (std::size_t i = 0; i < whole; i += 8)
      for (std::size_t lane = 0; lane < 8; ++lane) sum[lane] += 0 * values[i + lane];
    for (const double lane : sum) all += lane;
  }
  return all == 0;
}

}  // namespace sim
