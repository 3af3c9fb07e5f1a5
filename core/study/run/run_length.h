// The length of a run: a number of steps, or an end time.
#pragma once

#include <cstdint>
#include <optional>

#include "core/study/run/track.h"

namespace sim::study {

inline constexpr std::int64_t kMostSteps = 9'000'000'000'000'000;  // exact in a double

struct RunLength {
  std::optional<double> time;  // s, at most one of the two; neither = the scene's duration
  std::optional<std::int64_t> steps;
};

// The number of steps. Throws Error{kUsage} for more than kMostSteps.
std::int64_t steps_of(const RunLength& length, const Simulation& system);

// Steps between the rows of a report: ten of a system, four of each of a world.
std::int64_t row_stride(std::int64_t steps, bool world);

// Ends a run at the requested time, with a shorter last step if necessary.
void shorten(const RunLength& length, Track& track);
void shorten(double end, Track& track);  // s

}  // namespace sim::study
