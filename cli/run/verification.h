// Runs once more with half the step: when, beside the run or behind it, and what is said of it.
#pragma once

#include <ostream>
#include <span>

#include "cli/run/judged.h"

namespace sim::cli {

// Whether a run is verified: where that takes little time, or as asked.
enum class Verify { kQuick, kAlways, kNever };

// On cores that the run leaves alone, after so many seconds of a run that is asked to be verified.
// `words`: null where nothing is to be said.
void verify_beside(std::span<Track> tracks, Threads threads, double seconds, std::ostream* words);

// After a run of so many seconds. Short runs are always verified, and first-order ones, which are
// small; longer ones where the user asked for it.
void verify(Verify wish, std::span<Track> tracks, double seconds, std::ostream* words);

}  // namespace sim::cli
