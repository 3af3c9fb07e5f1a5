#include "core/base/finite.h"

#include <cstddef>

namespace sim {

// 0 * value is 0 for every finite value and nan otherwise.
bool all_finite(std::span<const double> values) {
  if (values.size() < 8) {
    double sum = 0;
    for (const double value : values) sum += 0 * value;
    return sum == 0;
  }
  double sum[8] = {};
  const std::size_t whole = values.size() / 8 * 8;
  for (std::size_t i = 0; i < whole; i += 8)
    for (std::size_t lane = 0; lane < 8; ++lane) sum[lane] += 0 * values[i + lane];
  for (std::size_t i = whole; i < values.size(); ++i) sum[0] += 0 * values[i];
  double all = 0;
  for (const double lane : sum) all += lane;
  return all == 0;
}

}  // namespace sim
