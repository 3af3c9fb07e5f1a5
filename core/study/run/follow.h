// A run that nobody watches.
#pragma once

#include <functional>

#include "core/study/run/track.h"

namespace sim::study {

// Takes and samples all steps that are left, as far as they go; told to stop, it is interrupted.
void follow(Track& track, const std::function<bool()>& stop);

}  // namespace sim::study
