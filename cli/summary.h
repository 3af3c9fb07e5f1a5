// The machine form of a run's report: one JSON object.
#pragma once

#include <span>
#include <string>

#include "cli/scene.h"
#include "cli/track.h"

namespace sim::cli {

// {"scene","systems":[...],"threads","seconds","verdict","reason"} with, for each system,
// {"name","order_of_state","particles","pinned","springs":{FAMILY:n},"integrator","dt","steps","t",
// "integrator_params":{NAME:text},"effort":{"steps","rejected","evaluations"},
// "energy":{"start","end","drift"},"error","hash","verdict","reason"}: springs and energy for
// second-order systems, error where the scene has an exact solution, components instead of
// particles for a flat state. dt, t and seconds in s, energies in J.
std::string summary_json(const LoadedScene& scene, std::span<Track> tracks, int threads,
                         double seconds);

// The state hash as 16 hexadecimal digits.
std::string hash_text(const Simulation& system);

}  // namespace sim::cli
