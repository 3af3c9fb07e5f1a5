// The schedule of the samples of a run: about 100, at uneven intervals.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace sim::study {

// Samples at equal intervals would miss a vibration of the same period. The k-th sample is shifted
// by the fractional part of k times the golden section, of an interval (Weyl 1916).
class SamplingSchedule {
 public:
  // From step `first` to step `last`.
  SamplingSchedule(std::int64_t first, std::int64_t last) : first_(first), last_(last) {}

  // The step of the next sample; the last step is one.
  std::int64_t next() const {
    constexpr double kGolden = 0.6180339887498949;
    const auto k = static_cast<double>(taken_);
    const double interval = static_cast<double>(last_ - first_) / kLooks;
    const double shift = k * kGolden - std::floor(k * kGolden);
    return std::min(last_, first_ + static_cast<std::int64_t>(interval * (k + shift)));
  }

  // True if a sample is due at `step`; it then counts as taken there.
  bool take(std::int64_t step) {
    if (step != last_ && step < next()) return false;
    while (step < last_ && next() <= step) ++taken_;
    return true;
  }

 private:
  static constexpr double kLooks = 100;
  std::int64_t first_, last_, taken_ = 0;
};

}  // namespace sim::study
