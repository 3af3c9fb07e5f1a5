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

// The steps it takes. Throws Error{kUsage} for more than kMostSteps.
std::int64_t steps_of(const RunLength& length, const Simulation& system);

// A run ends at the time asked for, with a shorter last step where it has to.
void shorten(const RunLength& length, Track& track);
void shorten(double end, Track& track);  // s

}  // namespace sim::study
