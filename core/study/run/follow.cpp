#include "core/study/run/follow.h"

namespace sim::study {

void follow(Track& track, const std::function<bool()>& stop) {
  track.sample();
  while (!track.finished()) {
    if (stop()) return track.mark_interrupted();
    if (track.advance(track.due()) == 0) {
      if (track.system().divergence().status == StepStatus::kStopped)
        return track.mark_interrupted();
      return track.mark_diverged();
    }
    track.sample();
  }
}

}  // namespace sim::study
