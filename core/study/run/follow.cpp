#include "core/study/run/follow.h"

namespace sim::study {

void follow(Track& track, const std::function<bool()>& stop, const std::function<void()>& between) {
  track.sample();
  while (!track.finished()) {
    if (stop()) return track.mark_interrupted();
    if (track.advance(track.due()) == 0) {
      if (track.system().divergence().status == StepStatus::kStopped)
        return track.mark_interrupted();
      return track.mark_diverged();
    }
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

void follow_all(std::span<Track> tracks, const std::function<bool()>& stop,
                const std::function<void()>& between) {
  if (tracks.size() == 1) return follow(tracks.front(), stop, between);
  for (Track& track : tracks) track.sample();
  while (Track* const track = furthest_behind(tracks)) {
    const bool stopped = stop();
    if (!stopped && track->advance(1) > 0) {
      track->sample();
      if (between) between();
      continue;
    }
    if (stopped || track->system().divergence().status == StepStatus::kStopped) {
      for (Track& each : tracks)
        if (!each.finished() && !each.stuck()) each.mark_interrupted();
      return;
    }
    track->mark_diverged();
  }
}

}  // namespace sim::study
