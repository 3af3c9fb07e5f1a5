#include "tests/bench/body_peers.h"

#include <algorithm>
#include <cmath>
#include <iostream>

#include "core/lua/scene/scene_file.h"
#include "tests/bench/kernel.h"
#include "tests/bench/peer.h"
#include "tests/bench/peer_scene.h"

namespace sim_bench {
namespace {

constexpr double kFall = 2, kRest = 1;  // s: the pile falls together, and then lies
constexpr double kHalf = 0.1;           // m, of an edge
constexpr long kSlice = 20;             // steps, in turns

sim::SystemSpec pile(int side, const std::string& tolerance, sim::Registry& registry) {
  sim::SceneOptions scene;
  scene.search_path = {SIM_BENCH_SCRIPTS};
  scene.settings = {{"n", std::to_string(side)}, {"tolerance", tolerance}};
  return sim::load_scene("scenes/pile.lua", registry, scene).systems.front();
}

std::vector<double> centers_of(const sim::Simulation& ours) {
  std::vector<double> x;
  for (int i = 0; i < ours.bodies(); ++i)
    for (const double each : ours.body_state(i).center) x.push_back(each);
  return x;
}

// Boxes that do not overlap are an edge apart, and half an edge above the ground.
double penetration_of(const std::vector<double>& x) {
  double deepest = 0;
  for (std::size_t i = 0; i < x.size(); i += 3) {
    deepest = std::max(deepest, kHalf - x[i + 1]);
    for (std::size_t j = 0; j < i; j += 3)
      deepest = std::max(
          deepest, 2 * kHalf - std::hypot(x[i] - x[j], x[i + 1] - x[j + 1], x[i + 2] - x[j + 2]));
  }
  return deepest;
}

double farthest(const std::vector<double>& from, const std::vector<double>& to) {
  double most = 0;
  for (std::size_t i = 0; i < from.size(); i += 3)
    most = std::max(most,
                    std::hypot(to[i] - from[i], to[i + 1] - from[i + 1], to[i + 2] - from[i + 2]));
  return most;
}

void measure_pile(const PeerKind& kind, int side, const std::string& tolerance,
                  sim::Registry& registry, std::vector<PileResult>& results) {
  sim::Simulation ours(pile(side, tolerance, registry), registry, {.threads = 1});
  const std::vector<double> start = centers_of(ours);
  Cubes cubes{{}, kHalf, 1, 0.5, ours.h()};
  for (std::size_t i = 0; i < start.size(); i += 3)
    cubes.centers.emplace_back(start[i], start[i + 1], start[i + 2]);
  const std::filesystem::path path = peer_folder() / "scene.txt";
  write_cubes(path, cubes);
  Peer peer(kind, path);
  PileResult its{.program = peer.about(), .boxes = ours.bodies()};
  PileResult own{.program = "sim, tolerance " + tolerance, .boxes = ours.bodies()};
  std::cerr << "bench: " << kind.name << ", " << own.boxes << " boxes, tolerance " << tolerance
            << "\n";
  const long steps = std::lround(kFall / ours.h()), more = std::lround(kRest / ours.h());
  const Contestant mine = contestant(ours);
  for (long step = 0; step < steps; step += kSlice) {
    its.seconds += peer.run(kSlice) / static_cast<double>(steps);
    own.seconds += mine.run(kSlice) / static_cast<double>(steps);
  }
  own.ratio = own.seconds / its.seconds;
  const std::vector<double> fallen = centers_of(ours);
  own.penetration = penetration_of(fallen);
  mine.run(more);
  own.creep = farthest(fallen, centers_of(ours));
  const std::vector<double> theirs = peer.positions_after(steps, start.size());
  its.penetration = penetration_of(theirs);
  its.creep = farthest(theirs, peer.positions_after(steps + more, start.size()));
  results.insert(results.end(), {its, own});
}

}  // namespace

std::vector<PileResult> measure_piles(const std::vector<PeerKind>& peers, const Options& options,
                                      sim::Registry& registry) {
  std::vector<PileResult> results;
  for (const PeerKind& kind : peers) {
    if (kind.name != "bullet") continue;
    for (const int side : {3, 4, 6, 10}) {
      const std::string name = "pile, " + std::to_string(side * side * side);
      if (name.find(options.only) == std::string::npos) continue;
      for (const char* const tolerance : {"1e-4", "1e-12"})
        measure_pile(kind, side, tolerance, registry, results);
    }
  }
  return results;
}

Table pile_table(const std::vector<PileResult>& results) {
  Table table("bodies", "Piles of boxes in another program, one thread, in turns with ours",
              {{"boxes", "boxes"},
               {"program", "program", false},
               {"us/step", "us_per_step"},
               {"times the peer", "ratio"},
               {"penetration, mm", "mm_penetration"},
               {"creep, mm/s", "mm_creep"}});
  for (const PileResult& r : results)
    table.add({std::to_string(r.boxes), r.program, short_number(1e6 * r.seconds),
               r.ratio > 0 ? short_number(r.ratio) : "", short_number(1e3 * r.penetration),
               short_number(1e3 * r.creep)});
  if (results.empty()) return table;
  table.note(
      "scenes/pile.lua with steps of 5 ms for 2 s, in which it falls together. penetration: of "
      "boxes into each other and the ground then, at least; creep: the farthest that a box moves "
      "in the second after it.");
  return table;
}

}  // namespace sim_bench
