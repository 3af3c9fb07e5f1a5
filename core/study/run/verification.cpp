#include "core/study/run/verification.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "core/base/duration_text.h"

namespace sim::study {
namespace {

constexpr double kRefined = 2;                  // times a run that half the step takes
constexpr double kChaotic = 4, kObserved = 10;  // likewise, with neighbours

// Stops on request, and after so many seconds.
std::function<bool()> stop_after(double seconds, const std::function<bool()>& stop) {
  using std::chrono::steady_clock;
  const auto end = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                             std::chrono::duration<double>(seconds));
  return [end, stop] { return stop() || steady_clock::now() >= end; };
}

void verify(const VerificationPlan& plan, Track& track, double seconds,
            const std::function<bool()>& stop, const std::function<void(double, double)>& told) {
  if (plan.wish == Verify::kNever) return track.leave_unverified("positions not verified");
  if (track.verified_before()) return track.verify(stop);
  const bool beside = track.verifies_beside();
  const bool whole =
      plan.wish == Verify::kAlways || seconds < Track::kQuick || !track.system().second_order();
  const ComparisonEffort effort{.spread = true, .early = !whole};
  if (whole || beside) {
    const double chaotic = track.observers().empty() ? kChaotic : kObserved;
    const double begun = beside ? seconds : 0;
    if (seconds > Track::kQuick && told)
      told(kRefined * seconds - begun, chaotic * seconds - begun);
    track.verify(stop, effort);
  } else {
    track.verify(stop_after(std::max(plan.seconds, plan.share * seconds), stop), effort);
  }
  if (!track.verified())
    track.leave_unverified("positions not verified" +
                           std::string(track.compared() ? " to the end" : "") +
                           ": --verify takes about " + rough_time(kRefined * seconds));
}

}  // namespace

bool verify_beside(const VerificationPlan& plan, std::span<Track> tracks, Threads threads,
                   const std::function<bool()>& stop) {
  if (plan.wish == Verify::kNever) return false;
  int taken = 1;  // by the systems, which take turns
  for (const Track& track : tracks)
    taken = std::max(taken, threads.as_pay ? track.system().threads() : threads.most);
  int free = static_cast<int>(std::thread::hardware_concurrency()) - taken;
  bool any = false;
  for (Track& track : tracks) {
    if (free <= 0 || !track.verify_beside(stop, plan.wish != Verify::kAlways)) continue;
    --free;
    any = true;
  }
  return any;
}

void verify(const VerificationPlan& plan, std::span<Track> tracks, double seconds,
            const std::function<bool()>& stop,
            const std::function<void(double usual, double chaotic)>& told) {
  for (Track& track : tracks) verify(plan, track, seconds, stop, told);
}

}  // namespace sim::study
