// The reason why a system could take no further step, in words.
#pragma once

#include <cstdint>
#include <string>

#include "core/scene/simulation.h"

namespace sim::study {

// "step 3, t = 0.015 s, h = 0.005 s".
std::string step_place(std::int64_t step, double t, double h);

// Describes its divergence(): the number that is not finite and its place, with the responsible
// force.
std::string divergence_text(const SystemSpec& spec, Simulation& system);

}  // namespace sim::study
