#include "tests/bench/ways.h"

#include <algorithm>
#include <iostream>
#include <map>

#include "core/lua/scene/scene_file.h"
#include "tests/bench/cloth.h"
#include "tests/bench/kernel.h"

namespace sim_bench {
namespace {

constexpr double kRepeat = 0.25;  // s: lists of near pairs are made several times in it

using Settings = std::map<std::string, std::string>;

struct Variant {
  std::string name;
  sim::SystemSpec spec;
  sim::RunOptions options;
};

struct Race {
  std::string scene;
  double from = 0;  // s: where timing begins
  std::vector<Variant> ways;
};

sim::SystemSpec load(const std::string& path, const Settings& settings, sim::Registry& registry) {
  sim::SceneOptions scene;
  scene.search_path = {SIM_BENCH_SOURCE "/tests/bench", SIM_BENCH_SCRIPTS};
  scene.settings = settings;
  return sim::load_scene(path, registry, scene).systems.front();
}

Race hall(sim::Registry& registry) {
  const auto of = [&](const char* name, const char* count, const char* sleep) {
    return Variant{name, load("rest/hall.lua", {{"count", count}, {"sleep", sleep}}, registry), {}};
  };
  return {"hall",
          3,  // by then, all but the one that moves are asleep
          {of("1 cloth, it moves", "1", "0"), of("100, one moves, sleep", "100", "1e-9"),
           of("100, one moves", "100", "0")}};
}

Race seam(sim::Registry& registry) {
  const auto of = [&](const std::string& name, const char* stiffness, const char* method,
                      double dt) {
    return Variant{name,
                   load("stiff/seam.lua", {{"seam", stiffness}}, registry),
                   {.integrator = {method, {}}, .dt = dt}};
  };
  constexpr double kStep = 0.001;
  Race race{"seam", 0.2, {of("none, verlet", "0", "verlet", kStep)}};
  for (const char* const k : {"1e4", "1e5", "1e6", "1e7", "1e8"})
    race.ways.push_back(of(std::string(k) + " N/m, imex", k, "imex", kStep));
  race.ways.push_back(of("1e6 N/m, trbdf2", "1e6", "trbdf2", kStep));
  race.ways.push_back(of("1e6 N/m, verlet", "1e6", "verlet", 1.5e-5));
  return race;
}

// imex at its step, trbdf2 at the same, and verlet at the largest that is stable.
Race stiff(const std::string& name, double step, double limit, sim::Registry& registry) {
  const sim::SystemSpec spec = load("stiff/" + name + ".lua", {}, registry);
  Race race{name, 0.1, {}};
  for (const char* const method : {"imex", "trbdf2"})
    race.ways.push_back({method, spec, {.integrator = {method, {}}, .dt = step}});
  race.ways.push_back({"verlet", spec, {.integrator = {"verlet", {}}, .dt = limit}});
  return race;
}

Race rod(sim::Registry& registry) {
  Race race = stiff("rod", 0.005, 0.0019, registry);
  race.ways.push_back({"constraint, verlet",
                       load("stiff/rod.lua", {{"kind", "rod"}}, registry),
                       {.integrator = {"verlet", {}}, .dt = 0.005}});
  return race;
}

Race liquid(int n, sim::Registry& registry) {
  const sim::SystemSpec law = load_gas(n, registry);
  sim::SystemSpec formula = law;
  sim::PartSpec& force = formula.forces.front();
  const double cutoff = number_of(force.given.at("cutoff"));
  const double skin = number_of(force.given.at("skin"));
  force.plugin = "expression";
  force.given = {{"energy", std::string("4 * (r^-12 - r^-6)")}, {"cutoff", cutoff}, {"skin", skin}};
  return {"liquid, " + std::to_string(n * n * n),
          0.1,
          {{"lennard_jones", law, {}},
           {"the same as a formula", formula, {}},
           {"lennard_jones, 2 threads", law, {.threads = 2}},
           {"formula, 2 threads", formula, {.threads = 2}}}};
}

Race solid(sim::Registry& registry) {
  Race race{"jelly_fem", 0.1, {}};
  for (const char* const model : {"neo_hookean", "stvk", "corotated"})
    for (const int threads : {1, 2})
      race.ways.push_back({std::string(model) + (threads == 2 ? ", 2 threads" : ""),
                           load("scenes/jelly_fem.lua", {{"n", "20"}, {"model", model}}, registry),
                           {.integrator = {"verlet", {}}, .dt = 0.001, .threads = threads}});
  return race;
}

void run_race(const Race& race, const Options& options, sim::Registry& registry,
              std::vector<VariantResult>& results) {
  std::cerr << "bench: " << race.scene << "\n";
  std::vector<sim::Simulation> simulations;
  for (const Variant& way : race.ways) simulations.emplace_back(way.spec, registry, way.options);
  std::vector<Contestant> contestants;
  for (sim::Simulation& each : simulations) {
    contestants.push_back(contestant(each));
    contestants.back().run(each.steps_for(race.from));
  }
  TimingOptions timing = options.timing;
  timing.seconds = std::max(timing.seconds, kRepeat);
  const std::vector<Times> times = measure(contestants, timing);
  const auto cost = [&](std::size_t i) { return times[i].least / simulations[i].h(); };
  for (std::size_t i = 0; i < times.size(); ++i)
    results.push_back({race.scene, race.ways[i].name, simulations[i].particles(),
                       simulations[i].h(), times[i], cost(i) / cost(0)});
}

}  // namespace

std::vector<VariantResult> measure_ways(const Options& options, sim::Registry& registry) {
  constexpr int kSides[] = {10, 22, 40};  // of a liquid, in particles
  std::vector<VariantResult> results;
  const auto run = [&](const std::string& name, auto make) {
    if (name.find(options.only) != std::string::npos) run_race(make(), options, registry, results);
  };
  run("hall", [&] { return hall(registry); });
  run("seam", [&] { return seam(registry); });
  run("masts", [&] { return stiff("masts", 0.005, 3e-4, registry); });
  run("skin", [&] { return stiff("skin", 0.002, 1.4e-4, registry); });
  run("rod", [&] { return rod(registry); });
  for (const int n : kSides) run("liquid", [&] { return liquid(n, registry); });
  run("jelly_fem", [&] { return solid(registry); });
  return results;
}

Table way_table(const std::vector<VariantResult>& results) {
  Table table("ways", "The same scene in more than one way, one thread unless said",
              {{"scene", "scene", false},
               {"way", "way", false},
               {"particles", "particles"},
               {"step, ms", "ms_of_step"},
               {"us/step", "us_per_step"},
               {"min", "us_min"},
               {"ms a second", "ms_per_second"},
               {"x first", "times_first"}});
  for (const VariantResult& r : results)
    table.add({r.scene, r.way, std::to_string(r.particles), short_number(1e3 * r.h),
               short_number(1e6 * r.times.median), short_number(1e6 * r.times.least),
               short_number(1e3 * r.times.median / r.h), short_number(r.ratio)});
  if (results.empty()) return table;
  table.note(
      "The ways of a scene are measured in turns. ms a second: time for a second of the scene; x "
      "first: its least over that of the first way. verlet of stiff parts takes 0.93 to 0.98 of "
      "the step up to which it is stable.");
  return table;
}

}  // namespace sim_bench
