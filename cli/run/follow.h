// A run that nobody watches.
#pragma once

#include <functional>

#include "cli/run/track.h"

namespace sim::cli {

// Takes and samples all steps that are left, as far as they go; told to stop, it is interrupted.
void follow(Track& track, const std::function<bool()>& stop);

}  // namespace sim::cli
