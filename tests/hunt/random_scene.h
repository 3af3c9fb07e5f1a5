// Scenes at random: chains, cloths, nets, lattices and first-order fields, with any method.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "core/plugin/registry.h"
#include "core/scene/simulation.h"

namespace sim_test {

struct RandomScene {
  sim::SystemSpec spec;
  sim::RunOptions options;
  std::int64_t steps = 0;
  std::string words;
  sim::OdeFunction field;     // of a first-order scene
  double longest = HUGE_VAL;  // step that sees all of it, s
};

// Masses of 1e-3 to 1e3 kg, stiffness of 1e-2 to 1e7 N/m, stretched and pressed starts, all
// methods, steps of 0.005 to 1.5 of the stable one, loose tolerances, single precision.
RandomScene random_scene(std::uint64_t seed, sim::Registry& registry);

}  // namespace sim_test
