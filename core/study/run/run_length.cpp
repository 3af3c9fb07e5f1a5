#include "core/study/run/run_length.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim::study {

std::int64_t steps_of(const RunLength& length, const Simulation& system) {
  if (length.steps) return *length.steps;
  const double duration = length.time.value_or(system.duration());
  if (!(duration / system.h() < static_cast<double>(kMostSteps)))
    throw Error(ErrorKind::kUsage,
                {"too many steps", brief(duration) + " s in steps of " + brief(system.h()) + " s",
                 "a run has at most 9e15 steps", "choose a larger --dt or a shorter --time"});
  return system.steps_for(duration);
}

std::int64_t row_stride(std::int64_t steps, bool world) {
  const std::int64_t rows = world ? 4 : 10;
  return std::max<std::int64_t>(1, steps / rows + (steps % rows != 0));
}

void shorten(const RunLength& length, Track& track) {
  if (!length.steps) shorten(length.time.value_or(track.system().duration()), track);
}

void shorten(double end, Track& track) {
  constexpr double kRoundedSteps = 1e-9;  // of a step
  const bool beyond = track.end() > end + kRoundedSteps * track.system().h();
  if (beyond && end > track.system().t()) track.end_at(end);
}

}  // namespace sim::study
