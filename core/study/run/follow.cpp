#include "core/study/run/follow.h"

#include <algorithm>

namespace sim::study {

namespace {

// Whether a step was not taken because of a request to stop.
bool was_stopped(const Track& track, const std::function<bool()>& stop, const Advance& advance) {
  return track.system().divergence().status == StepStatus::kStopped ||
         (advance && !track.stuck() && stop());
}

void leave_stuck(Track& track) {
  if (!track.stuck()) track.mark_diverged();
}

int steps_taken(Track& track, std::int64_t most, const Advance& advance) {
  return advance ? advance(track, most) : track.advance(most);
}

}  // namespace

void follow(Track& track, const std::function<bool()>& stop, const std::function<void()>& between,
            const Advance& advance) {
  track.sample();
  while (!track.finished()) {
    if (stop()) return track.mark_interrupted();
    if (steps_taken(track, track.due(), advance) == 0)
      return was_stopped(track, stop, advance) ? track.mark_interrupted() : leave_stuck(track);
    track.sample();
    if (between) between();
  }
}

Track* furthest_behind(std::span<Track> tracks) {
  Track* next = nullptr;
  for (Track& track : tracks)
    if (!track.finished() && !track.stuck() && (!next || track.system().t() < next->system().t()))
      next = &track;
  return next;
}

double done_share(std::span<const Track> tracks) {
  double done = 1;
  for (const Track& track : tracks) {
    const auto left = static_cast<double>(track.steps() - track.system().step_count());
    const auto taken = static_cast<double>(track.taken());
    if (left > 0) done = std::min(done, taken / (taken + left));
  }
  return done;
}

void follow_all(std::span<Track> tracks, const std::function<bool()>& stop,
                const std::function<void()>& between, const Advance& advance) {
  if (tracks.size() == 1) return follow(tracks.front(), stop, between, advance);
  for (Track& track : tracks) track.sample();
  while (Track* const track = furthest_behind(tracks)) {
    const bool stopped = stop();
    if (!stopped && steps_taken(*track, 1, advance) > 0) {
      track->sample();
      if (between) between();
      continue;
    }
    if (stopped || was_stopped(*track, stop, advance)) {
      for (Track& each : tracks)
        if (!each.finished() && !each.stuck()) each.mark_interrupted();
      return;
    }
    leave_stuck(*track);
  }
}

}  // namespace sim::study
