// Runs without an audience.
#pragma once

#include <functional>
#include <span>

#include "core/study/run/track.h"

namespace sim::study {

// Takes at most so many steps of a track in place of Track::advance; 0: it could take none.
using Advance = std::function<int(Track& track, std::int64_t most)>;

// Takes and samples all remaining steps, as far as they go; told to stop, it is interrupted.
// `between` is called after every sample.
void follow(Track& track, const std::function<bool()>& stop,
            const std::function<void()>& between = {}, const Advance& advance = {});

// Systems advance together: the one furthest behind in time takes the next step. Null if all are at
// their ends, or stuck.
Track* furthest_behind(std::span<Track> tracks);

// The share of the steps of a run that is done, of the system that has most left.
double done_share(std::span<const Track> tracks);

// Follows several systems. One that diverges is left behind by the others.
void follow_all(std::span<Track> tracks, const std::function<bool()>& stop,
                const std::function<void()>& between = {}, const Advance& advance = {});

}  // namespace sim::study
