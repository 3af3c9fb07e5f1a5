#include "tests/hunt/goals.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <random>
#include <sstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/study/accuracy/error_goal.h"
#include "core/study/accuracy/work_precision.h"
#include "tests/hunt/random_scene.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

using namespace sim::study;

bool watch(std::string_view, double) { return true; }

// The largest rms distance of the chosen run from the reference, as far as that is known to a fifth
// of what is allowed; not a number where that is nowhere.
double true_error(const Problem& problem, const GoalChoice& choice, const Reference& reference,
                  double until) {
  if (reference.points.empty()) return std::nan("");
  const auto steps = static_cast<std::int64_t>(std::llround(choice.time / choice.dt));
  int intervals = reference.seen_of(steps);
  double most = std::nan("");
  const int stride = reference.intervals() / intervals;
  TrajectoryPlan plan{
      .time = choice.time, .intervals = intervals, .steps = steps, .tolerance = choice.tolerance};
  plan.see = [&](int k, const std::vector<double>& x) {
    const auto at = static_cast<std::size_t>(k * stride);
    if (k == 0 || reference.error[at] > 0.2 * choice.allowed) return;
    if (choice.time * k / intervals > until) return;
    const double rms = distance(x, reference.points[at]).rms;
    if (!(rms <= most)) most = rms;
  };
  run_trajectory(problem, *choice.method, plan, [] { return true; });
  return most;
}

struct Cheapest {
  double cost = std::nan("");
  std::string name;
};

Cheapest cheapest_of(const WorkPrecision& study, double allowed) {
  Cheapest best;
  for (const Curve& curve : study.curves)
    for (const Point& point : curve.points) {
      const double cost = cost_of(point.effort);
      if (!stable(point, study.size) || point.rms > allowed || cost >= best.cost) continue;
      best = {cost, curve.method.label + " " +
                        sim::brief(point.tolerance > 0 ? point.tolerance : point.dt, 3)};
    }
  return best;
}

bool missed(const GoalCase& each) { return each.kept && each.missed > 1.5; }

std::string short_number(double value) { return std::isnan(value) ? "-" : sim::brief(value, 2); }

void print(const GoalCase& each) {
  std::cout << std::left << std::setw(22) << each.scene << std::right << std::setw(7)
            << sim::brief(each.wanted, 1) << "  " << std::left << std::setw(28)
            << (each.failed.empty() ? each.chosen : each.failed.substr(0, 200)) << std::setw(9)
            << (each.failed.empty() ? each.kept ? "kept" : "not kept" : "error") << std::right
            << std::setw(8) << short_number(each.missed) << std::setw(8) << short_number(each.cost)
            << std::setw(8) << short_number(each.trials) << "  " << each.cheapest
            << (each.kept || !std::isfinite(each.horizon)
                    ? ""
                    : ", until " + sim::brief(each.horizon, 3) + " s")
            << '\n'
            << std::flush;
}

}  // namespace

std::vector<GoalCase> try_goals(const std::string& name, const sim::SystemSpec& spec, double time,
                                std::span<const double> shares, bool tradeoff,
                                sim::Registry& registry) {
  std::vector<GoalCase> cases;
  const Problem problem{&spec, &registry};
  std::unique_ptr<WorkPrecision> study;
  std::optional<Reference> known;
  std::string failed;
  try {
    if (tradeoff)
      study = work_precision(
          problem, {.time = time, .budget = *std::ranges::min_element(shares), .repeats = 0},
          watch);
    else
      known = reference(problem, time, watch);
  } catch (const sim::Error& error) {
    failed = error.what();
  }
  for (const double share : shares) {
    GoalCase each{.scene = name, .wanted = share};
    try {
      const GoalChoice choice =
          choose_for_error(problem, {.budget = {share, false}, .time = time}, watch);
      if (choice.method) {
        each.chosen = choice.method->label + " " +
                      sim::brief(choice.tolerance > 0 ? choice.tolerance : choice.dt, 3);
        each.kept = choice.kept;
        each.horizon = choice.horizon;
        each.trials = choice.trials / choice.cost;
        if (study || known) {
          const Reference& reference = study ? study->reference : *known;
          each.missed =
              true_error(problem, choice, reference, choice.kept ? HUGE_VAL : choice.horizon) /
              choice.allowed;
        }
        if (study && study->comparable == study->time) {
          const Cheapest best = cheapest_of(*study, choice.allowed);
          each.cheapest = best.name;
          each.cost = choice.cost / best.cost;
        }
      } else {
        each.failed = "no method";
      }
    } catch (const sim::Error& error) {
      each.failed = error.what();
    }
    print(each);
    cases.push_back(std::move(each));
  }
  return cases;
}

std::string random_contact_scene(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&](double low, double high) {
    return low + (high - low) * std::generate_canonical<double, 53>(random);
  };
  std::ostringstream lua;
  const int kind = static_cast<int>(seed % 4);
  const double restitution = between(0, 1), friction = seed % 3 == 0 ? 0 : between(0, 0.8);
  lua << "local sim = require 'sim'\n"
      << "local ground = sim.collider.plane { normal = {" << between(-0.3, 0.3)
      << ", 1, 0}, restitution = " << restitution << ", friction = " << friction << " }\n"
      << "local ball = sim.collider.sphere { center = {0, 0, 0}, radius = 0.5, friction = "
      << friction << " }\n";
  const int n = 2 + static_cast<int>(seed / 4 % 5);
  if (kind == 3) {
    lua << "local bodies = {}\n";
    for (int i = 0; i < n; ++i)
      lua << "bodies[" << i + 1 << "] = sim.rigid { shape = sim.box { half = {" << between(0.2, 0.5)
          << "," << between(0.2, 0.5) << ",0.3} }, mass = " << between(0.5, 5) << ", position = {"
          << between(-0.2, 0.2) << "," << 1.2 * (i + 1) << ",0}, velocity = {" << between(-1, 1)
          << ",0,0}, friction = " << friction << " }\n";
    lua << "return sim.scene { name = 'contact', bodies = bodies, colliders = { ground }, "
           "forces = { sim.force.gravity {} }, integrator = 'verlet', dt = 0.002, duration = 1 }\n";
    return lua.str();
  }
  lua << "local p = sim.particles { mass = " << between(0.1, 2) << " }\n";
  for (int i = 0; i < n; ++i)
    lua << "p:add({" << 0.3 * i - 0.4 << "," << between(0.7, 1.2) << "," << between(-0.2, 0.2)
        << "}, { velocity = {" << between(-1, 1) << "," << between(-1, 1) << ",0} })\n";
  lua << "local ties = {}\nfor i = 0, " << n - 2 << " do ties[i + 1] = {i, i + 1} end\n";
  if (kind == 2) lua << "p:pin(0)\n";
  lua << "return sim.scene { name = 'contact', particles = p, forces = { sim.force.gravity {}";
  if (kind != 2)
    lua << ", sim.force.spring { stiffness = " << std::pow(10, between(1, 4)) << ", ties = ties }";
  lua << " }, ";
  if (kind == 2) lua << "constraints = { sim.constraint.distance { ties = ties } }, ";
  if (kind != 2) lua << "colliders = { " << (kind == 0 ? "ground" : "ground, ball") << " }, ";
  lua << "integrator = 'verlet', dt = 0.002, duration = " << between(0.4, 1.5) << " }\n";
  return lua.str();
}

int hunt_goals(std::span<char* const> words) {
  sim::Registry registry = make_registry();
  const double shares[] = {1e-2, 1e-3, 1e-5};
  double time = 0;
  bool tradeoff = true;
  std::vector<GoalCase> all;
  const auto take = [&](const std::vector<GoalCase>& cases) {
    all.insert(all.end(), cases.begin(), cases.end());
  };
  const auto number = [&](std::size_t i, long fallback) {
    return i < words.size() && std::isdigit(static_cast<unsigned char>(*words[i]))
               ? std::atol(words[i])
               : fallback;
  };
  std::cout << "scene                    error  chosen                      says       "
               "missed    cost  trials  cheapest of a tradeoff\n";
  const auto try_file = [&](const std::string& name, const std::string& file) {
    try {
      const sim::SceneSpec scene =
          sim::load_scene(file, registry, {.search_path = {SIM_SOURCE_DIR "/scripts"}});
      for (const sim::SystemSpec& system : scene.systems) {
        const double length = system.duration > 0 ? system.duration : 1;
        take(try_goals(name, system, time > 0 ? std::min(time, length) : length, shares, tradeoff,
                       registry));
      }
    } catch (const sim::Error& error) {
      std::cout << name << ": " << error.what() << '\n';
    }
  };
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string word = words[i];
    if (word == "--no-tradeoff") {
      tradeoff = false;
    } else if (word == "--time" && i + 1 < words.size()) {
      time = std::atof(words[++i]);
    } else if (word == "random" || word == "contact") {
      const long count = number(i + 1, 40), first = number(i + 2, 1);
      while (i + 1 < words.size() && std::isdigit(static_cast<unsigned char>(*words[i + 1]))) ++i;
      for (long seed = first; seed < first + count; ++seed) {
        const std::string name = word + " " + std::to_string(seed);
        if (word == "random") {
          const RandomScene scene = random_scene(static_cast<std::uint64_t>(seed), registry);
          sim::SystemSpec spec = scene.spec;
          spec.integrator = scene.options.integrator;
          spec.dt = scene.options.dt;
          const std::vector<GoalCase> cases = try_goals(
              name, spec, spec.dt * static_cast<double>(scene.steps), shares, tradeoff, registry);
          if (std::ranges::any_of(cases, missed)) std::cout << "  " << scene.words << '\n';
          take(cases);
        } else {
          const auto file =
              std::filesystem::temp_directory_path() / ("contact_" + std::to_string(seed) + ".lua");
          std::ofstream(file) << random_contact_scene(static_cast<std::uint64_t>(seed));
          try_file(name, file.string());
          std::filesystem::remove(file);
        }
      }
    } else {
      try_file(std::filesystem::path(word).stem().string(), word);
    }
  }
  int kept = 0, known = 0, missed_ones = 0, dear = 0, priced = 0;
  for (const GoalCase& each : all) {
    kept += each.kept;
    known += each.kept && !std::isnan(each.missed);
    missed_ones += missed(each);
    priced += each.kept && !std::isnan(each.cost);
    dear += each.kept && each.cost > 2;
  }
  std::cout << all.size() << " errors asked for, " << kept << " kept; of " << known
            << " that a reference judges " << missed_ones << " missed by more than 1.5 times; of "
            << priced << " that a tradeoff prices " << dear << " cost more than 2 times\n";
  return missed_ones == 0 ? 0 : 1;
}

}  // namespace sim_test
