// Pulses: forces and right-hand sides that act for a short time, whatever the state.
#pragma once

#include <cstddef>
#include <vector>

#include "core/scene/simulation.h"

namespace sim::study {

// True if f has parts that may depend on time.
bool may_have_pulses(Simulation& run);

// True if particles or colliders move as functions of time.
bool has_given_motion(Simulation& run);

// The numbers of X whose rates of change are forces or right-hand sides.
std::vector<std::size_t> driven_numbers(const Simulation& run);

// The duration of the shortest pulse in the next `time` seconds, s, as far as samples at the
// present state show it: 20,000, or 100 of a large system; infinite if there is none, or none that
// is short beside that time.
double shortest_pulse(Simulation& run, double time);

}  // namespace sim::study
