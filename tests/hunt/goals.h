// Errors that are asked for, and what the runs chosen for them really are off by: scenes at random
// and scene files, each judged by a reference of other methods, and by what a full tradeoff finds.
#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "core/scene/scene_spec.h"

namespace sim_test {

struct GoalCase {
  std::string scene;
  double wanted = 0;             // of the size
  std::string chosen;            // method and step
  bool kept = false;             // it says so
  double missed = std::nan("");  // true error over the one allowed; not a number: not known
  double cost = std::nan("");    // over the cheapest that a tradeoff finds, likewise
  double trials = 0;             // over the cost of the run
  std::string cheapest;          // of the tradeoff
  double horizon = HUGE_VAL;     // s
  std::string failed;            // what was thrown instead
};

// At each error, in shares of the size.
std::vector<GoalCase> try_goals(const std::string& name, const sim::SystemSpec& spec, double time,
                                std::span<const double> shares, bool tradeoff,
                                sim::Registry& registry);

// A scene as a Lua file says it: balls on planes and spheres, chains of rods, piles of boxes,
// springs between them.
std::string random_contact_scene(std::uint64_t seed);

// 0 if no run that says it kept the error missed it by more than 1.5 times.
// Words: goals [random N [SEED]] [contact N [SEED]] [SCENE.lua ...] [--time S] [--no-tradeoff]
int hunt_goals(std::span<char* const> words);

}  // namespace sim_test
