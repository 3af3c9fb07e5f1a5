// Many runs of one scene at once.
#pragma once

#include <span>

namespace sim {

class Simulation;

// True if equal explicit steps of such a run can be made side by side with those of others.
bool may_step_side_by_side(const Simulation& run);

// From now on the runs, which are all at their start, are stepped side by side in one thread,
// whoever asks for their steps and in whatever order; each has the bits of a run by itself. Those
// that differ from the first in more than numbers go on alone; false where all do. All outlive the
// last step of any.
bool step_side_by_side(std::span<Simulation* const> runs);

}  // namespace sim
