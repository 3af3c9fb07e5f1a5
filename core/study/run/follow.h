// A run that nobody watches.
#pragma once

#include <functional>
#include <span>

#include "core/study/run/track.h"

namespace sim::study {

// Takes and samples all steps that are left, as far as they go; told to stop, it is interrupted.
// `between` is called after every sample.
void follow(Track& track, const std::function<bool()>& stop,
            const std::function<void()>& between = {});

// Systems go together: the one that is furthest behind in time takes the next step. Null when all
// are at their ends, or stuck.
Track* furthest_behind(std::span<Track> tracks);

// The same of several systems. One that diverges is left behind by the others.
void follow_all(std::span<Track> tracks, const std::function<bool()>& stop,
                const std::function<void()>& between = {});

}  // namespace sim::study
