#include "tests/bench/many.h"

#include <algorithm>
#include <iostream>
#include <map>

#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/particles/constraints/constraint_system.h"
#include "tests/bench/kernel.h"

namespace sim_bench {
namespace {

struct ManyCase {
  std::string scene;
  std::map<std::string, std::string> settings;
  double from = 0, time = 0;  // s: where timing begins, and how long it lasts
  int count = 0;              // 0: its bodies
};

std::vector<ManyCase> cases() {
  std::vector<ManyCase> list;
  for (const int side : {6, 10})
    list.push_back({"pile", {{"n", std::to_string(side)}, {"tolerance", "1e-4"}}, 1, 0.25, 0});
  for (const int dolls : {10, 100})
    list.push_back({"ragdoll", {{"n", std::to_string(dolls)}}, 0.5, 0.1, 0});
  for (const int rods : {200, 1000, 5000, 10000})
    list.push_back({"rope", {{"n", std::to_string(rods)}}, 0, 0.1, rods});
  constexpr int kSide = 64;
  list.push_back({"drape_rods", {{"n", std::to_string(kSide)}}, 0.2, 0.1, 2 * kSide * (kSide - 1)});
  return list;
}

ManyResult measure_case(const ManyCase& which, sim::Registry& registry) {
  constexpr long kSlice = 5;  // steps, in turns
  sim::SceneOptions scene;
  scene.search_path = {SIM_BENCH_SCRIPTS};
  scene.settings = which.settings;
  const sim::SystemSpec spec =
      sim::load_scene("scenes/" + which.scene + ".lua", registry, scene).systems.front();
  sim::Simulation one(spec, registry, {.threads = 1}), two(spec, registry, {.threads = 2});
  ManyResult result{.scene = which.scene, .count = which.count, .h = one.h()};
  if (which.count == 0) result.count = one.bodies();
  std::cerr << "bench: " << which.scene << ", " << result.count << "\n";
  const Contestant first = contestant(one), second = contestant(two);
  const long begin = one.steps_for(which.from), end = one.steps_for(which.from + which.time);
  if (begin > 0) first.run(begin), two.restore(one.snapshot());
  double on_two = 0;
  for (long step = begin; step < end; step += kSlice) {
    const long count = std::min(kSlice, end - step);
    result.seconds += first.run(count);
    on_two += second.run(count);
  }
  result.faster = result.seconds / on_two;
  result.seconds /= static_cast<double>(end - begin);
  result.constraint = one.constraint_system()->drift(one.t(), one.state().data()).position;
  result.same = one.hash() == two.hash();
  return result;
}

}  // namespace

std::vector<ManyResult> measure_many(const Options& options, sim::Registry& registry) {
  std::vector<ManyResult> results;
  for (const ManyCase& which : cases())
    if (which.scene.find(options.only) != std::string::npos)
      results.push_back(measure_case(which, registry));
  return results;
}

Table many_table(const std::vector<ManyResult>& results) {
  Table table("many", "Many bodies and rods",
              {{"scene", "scene", false},
               {"count", "count"},
               {"step, ms", "ms_of_step"},
               {"us/step", "us_per_step"},
               {"us each", "us_each"},
               {"2 threads", "times_on_two_threads"},
               {"same bits", "same_bits", false},
               {"constraints, m", "m_constraint"}});
  for (const ManyResult& r : results)
    table.add({r.scene, std::to_string(r.count), short_number(1e3 * r.h),
               short_number(1e6 * r.seconds), short_number(1e6 * r.seconds / r.count),
               short_number(r.faster), r.same ? "yes" : "no", sim::brief(r.constraint, 2)});
  if (results.empty()) return table;
  table.note(
      "count: bodies, or rods. The pile from 1 s on, dolls from 0.5 s, ropes for 0.1 s from their "
      "start, the net from 0.2 s. 2 threads: how many times as fast they are as one, in turns.");
  return table;
}

}  // namespace sim_bench
