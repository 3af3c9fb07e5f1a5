#include "cli/run/verification.h"

#include <algorithm>
#include <thread>

#include "cli/run/study_progress.h"
#include "cli/terminal/signals.h"

namespace sim::cli {

void verify_beside(std::span<Track> tracks, Threads threads, double seconds, std::ostream* words) {
  auto free =
      static_cast<int>(std::thread::hardware_concurrency()) - (threads.as_pay ? 1 : threads.most);
  double done = 1;
  bool any = false;
  for (Track& track : tracks) {
    if (free <= 0 || !track.verify_beside(SessionSignals::any)) continue;
    --free;
    any = true;
    const std::int64_t left = track.steps() - track.system().step_count();
    done = std::min(done, static_cast<double>(track.taken()) /
                              static_cast<double>(std::max<std::int64_t>(1, track.taken() + left)));
  }
  if (any && words)
    *words << "sim: note: verifying with half the step on another core, in all about "
           << rough_time(2 * seconds / done) << '\n'
           << std::flush;
}

void verify(Verify wish, std::span<Track> tracks, double seconds, std::ostream* words) {
  for (Track& track : tracks) {
    const bool wanted =
        wish == Verify::kAlways ||
        (wish == Verify::kQuick && (seconds < Track::kQuick || !track.system().second_order()));
    if (!wanted) {
      track.leave_unverified(wish == Verify::kNever
                                 ? "positions not verified"
                                 : "positions not verified: --verify takes about " +
                                       rough_time(2 * seconds));
      continue;
    }
    const double chaotic = track.observers().empty() ? 4 : 10;  // times the run
    const double begun = track.verifies_beside() ? seconds : 0;
    if (seconds > Track::kQuick && words)
      *words << "sim: note: verifying with half the step takes about "
             << rough_time(2 * seconds - begun) << (begun > 0 ? " more" : "") << ", and "
             << rough_time(chaotic * seconds - begun)
             << " where the motion is chaotic; Ctrl-C skips it\n"
             << std::flush;
    track.verify(SessionSignals::any, true);
  }
}

}  // namespace sim::cli
