// How often a loop looks up, whose rounds may take nanoseconds or seconds.
#pragma once

#include <algorithm>

#include "core/base/stopwatch.h"

namespace sim {

// Reading a clock, or asking whether to go on, would take longer than a short round. The time
// between looks is about a millisecond, or a round.
class Pacer {
 public:
  bool due() {
    if (++rounds_ < stride_) return false;
    const double passed = since_.seconds();
    since_ = Stopwatch();
    rounds_ = 0;
    if (passed < kSoon) stride_ = std::min(2 * stride_, kMostRounds);
    if (passed > kLate) stride_ = std::max(1, stride_ / 2);
    return true;
  }

 private:
  static constexpr double kSoon = 5e-4, kLate = 2e-3;  // s
  static constexpr int kMostRounds = 1024;             // a round that takes longer than all before

  Stopwatch since_;
  int rounds_ = 0, stride_ = 1;
};

}  // namespace sim
