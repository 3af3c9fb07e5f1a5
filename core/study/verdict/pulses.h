// Pulses: forces and right-hand sides that act for a short time, whatever the state.
#pragma once

#include <cstddef>
#include <vector>

#include "core/scene/simulation.h"

namespace sim::study {

// True if f has parts that may depend on time.
bool may_have_pulses(Simulation& run);

// The numbers of X whose rates of change are forces or right-hand sides.
std::vector<std::size_t> driven_numbers(const Simulation& run);

// The duration of the shortest pulse in the next `time` seconds, s, as far as some 20,000 samples
// at the present state show it; infinite if there is none. Costs up to 3e5 evaluations of f of one
// particle.
double shortest_pulse(Simulation& run, double time);

}  // namespace sim::study
