// The scenes of the benchmark: the cloth of scripts/scenes/cloth.lua, variations on its springs,
// and the gas.
#pragma once

#include <string>

#include "cli/command_line/integrator_choice.h"
#include "core/plugin/registry.h"
#include "core/scene/scene_spec.h"
#include "core/scene/simulation.h"

namespace sim_bench {

// The plugins of this build.
sim::Registry make_registry();

// scenes/cloth.lua with n particles a side, read like any user's scene.
sim::SystemSpec load_cloth(int n, sim::Registry& registry);

// scenes/gas.lua with n^3 particles as dense as a liquid, 0.8 / sigma^3, and every number that
// LAMMPS has to know given.
sim::SystemSpec load_gas(int n, sim::Registry& registry);

// The same springs, listed one by one with their stiffness and rest length in a single force.
enum class Ties {
  kPlain,     // in the order of the grids
  kShuffled,  // particles renumbered at random: no runs of equal offset are left
  kJittered,  // every rest length its own, within 0.1 %
};
sim::SystemSpec tied_cloth(const sim::SystemSpec& cloth, Ties ties);

// Without gravity and drag.
sim::SystemSpec springs_only(sim::SystemSpec spec);

// A parameter that a scene gives as a whole number or as any number.
double number_of(const sim::Value& value);

long count_springs(const sim::SystemSpec& spec);

// A step size that keeps the n x n cloth bounded for any number of steps: from the bound
// omega^2 <= 2/m sum k = 1400 n^2 / s^2 and, where the method has no stable part of the imaginary
// axis, from the drag, c/m = 2 / s.
double stable_step(const std::string& integrator, int n);

// With that integrator at that step. Throws sim::Error{kUsage}.
sim::RunOptions run_options(const sim::MethodChoice& choice, int n, sim::Registry& registry);

}  // namespace sim_bench
