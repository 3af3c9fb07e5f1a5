// Verification of runs by a refined run: when, for how long, and whether beside them or after them.
#pragma once

#include <functional>
#include <span>

#include "core/base/thread_count_tuner.h"
#include "core/study/run/track.h"

namespace sim::study {

// kQuick: if it costs little, see VerificationPlan; kAlways: to the end, whatever it costs.
enum class Verify { kNever = 0, kQuick = 1, kAlways = 2 };

// Runs below a second are verified after the run, to the end, and so are first-order ones, which
// are small. Longer ones are verified beside the run if a core is free, until the two are far
// apart; otherwise after it, for no longer than this allows.
struct VerificationPlan {
  Verify wish = Verify::kQuick;
  double seconds = 1;  // of the clock
  double share = 0;    // of the time of the run; the longer of the two counts
};

// Called after `seconds` of a run that goes on: refined runs begin on idle cores, as many as there
// are. False: none began.
bool verify_beside(const VerificationPlan& plan, std::span<Track> tracks, Threads threads,
                   const std::function<bool()>& stop);

// Called after a run of `seconds`. `told` receives the seconds it may take more and, in chaotic
// motion, is called before each system that takes more than a second.
void verify(const VerificationPlan& plan, std::span<Track> tracks, double seconds,
            const std::function<bool()>& stop,
            const std::function<void(double usual, double chaotic)>& told = {});

}  // namespace sim::study
