#include "tests/bench/contact_peers.h"

#include <algorithm>
#include <cmath>
#include <iostream>

#include "core/lua/scene/scene_file.h"
#include "tests/bench/cloth.h"
#include "tests/bench/kernel.h"
#include "tests/bench/peer.h"
#include "tests/bench/peer_scene.h"

namespace sim_bench {
namespace {

constexpr double kClothStep = 0.004;               // s, of the peer
constexpr double kClothTime = 1, kStackTime = 10;  // s

// How deep particles are in the sphere, and how long springs.
void judge(const sim::Simulation& ours, const sim::SystemSpec& spec, const std::vector<double>& x,
           ContactResult& result) {
  const sim::PartSpec& sphere = spec.colliders.front();
  const auto center = std::get<sim::Vec3>(sphere.given.at("center"));
  const double radius = number_of(sphere.given.at("radius"));
  const auto at = [&x](int i) {
    const double* const p = &x[3 * static_cast<std::size_t>(i)];
    return sim::Vec3(p[0], p[1], p[2]);
  };
  for (int i = 0; i < ours.particles(); ++i) {
    const double depth = radius - (at(i) - center).norm();
    result.inside += depth > 1e-9;
    result.deepest = std::max(result.deepest, depth);
    for (const sim::Link& link : ours.links(i))
      result.longest = std::max(result.longest, (at(i) - at(link.to)).norm() / link.rest - 1);
  }
  result.deepest = std::max(result.deepest, 0.0);
}

void time_both(Peer& peer, sim::Simulation& ours, const Options& options, ContactResult& its,
               ContactResult& own) {
  const std::vector<Times> times = measure(
      {{[&peer](long count) { return peer.run(count); }}, contestant(ours)}, options.timing);
  its.seconds = times[0].median;
  own.seconds = times[1].median;
}

void measure_cloth(const PeerKind& kind, int n, const Options& options, sim::Registry& registry,
                   std::vector<ContactResult>& results) {
  const sim::SystemSpec spec = with_sphere(load_cloth(n, registry), 0.001, 0.5);
  const std::filesystem::path scene = peer_folder() / "scene.txt";
  sim::Simulation ours(spec, registry, {.integrator = {"verlet"}, .dt = stable_step("verlet", n)});
  write_scene(scene, spec, sim::Simulation(spec, registry, {.dt = kClothStep}));
  Peer peer(kind, scene);
  const std::string title = "cloth on a sphere";
  ContactResult its{.scene = title, .program = peer.about(), .count = n * n, .h = kClothStep};
  ContactResult own{.scene = title, .program = "sim, verlet", .count = n * n, .h = ours.h()};
  const auto size = static_cast<std::size_t>(3 * n * n);
  judge(ours, spec, peer.positions_after(std::lround(kClothTime / kClothStep), size), its);
  contestant(ours).run(std::lround(kClothTime / ours.h()));
  judge(ours, spec, positions_of(ours), own);
  time_both(peer, ours, options, its, own);
  results.insert(results.end(), {its, own});
}

void measure_stack(const PeerKind& kind, const Options& options, sim::Registry& registry,
                   std::vector<ContactResult>& results) {
  sim::SceneOptions scene;
  scene.search_path = {SIM_BENCH_SCRIPTS};
  const sim::SystemSpec spec = sim::load_scene("scenes/stack.lua", registry, scene).systems.front();
  sim::Simulation ours(spec, registry, {});
  constexpr int kBoxes = 10;
  Cubes cubes{{}, 0.5, 1, 0.5, ours.h()};
  const auto center_of = [&ours](int i) { return ours.body_state(i).center; };
  for (int i = 0; i < kBoxes; ++i) cubes.centers.push_back(center_of(i));
  const std::filesystem::path path = peer_folder() / "scene.txt";
  write_cubes(path, cubes);
  Peer peer(kind, path);
  const std::string title = "stack of boxes";
  ContactResult its{.scene = title, .program = peer.about(), .count = kBoxes, .h = ours.h()};
  ContactResult own{.scene = title, .program = "sim, verlet", .count = kBoxes, .h = ours.h()};
  const long steps = std::lround(kStackTime / ours.h());
  const std::vector<double> theirs = peer.positions_after(steps, 3 * kBoxes);
  contestant(ours).run(steps);
  for (std::size_t i = 0; i < kBoxes; ++i) {
    const sim::Vec3 start = cubes.centers[i];
    const sim::Vec3 there(theirs[3 * i], theirs[3 * i + 1], theirs[3 * i + 2]);
    its.creep = std::max(its.creep, (there - start).norm());
    own.creep = std::max(own.creep, (center_of(static_cast<int>(i)) - start).norm());
  }
  time_both(peer, ours, options, its, own);
  results.insert(results.end(), {its, own});
}

}  // namespace

std::vector<ContactResult> measure_contact(const std::vector<PeerKind>& peers,
                                           const Options& options, sim::Registry& registry) {
  std::vector<ContactResult> results;
  for (const PeerKind& kind : peers) {
    if (kind.name != "bullet") continue;
    for (const int n : {32, 128}) {
      std::cerr << "bench: bullet, a cloth on a sphere, n = " << n << "\n";
      measure_cloth(kind, n, options, registry, results);
    }
    std::cerr << "bench: bullet, a stack of boxes\n";
    measure_stack(kind, options, registry, results);
  }
  return results;
}

Table contact_table(const std::vector<ContactResult>& results) {
  Table table("contact", "Contact in another program, one thread, in turns with ours",
              {{"scene", "scene", false},
               {"n", "count"},
               {"program", "program", false},
               {"step, ms", "ms_of_step"},
               {"us/step", "us_per_step"},
               {"M/s", "million_steps_per_s"},
               {"s a second", "seconds_per_second"},
               {"inside", "inside"},
               {"deepest, mm", "mm_deepest"},
               {"strain, %", "percent_strain"},
               {"creep, mm", "mm_creep"}});
  for (const ContactResult& r : results) {
    const bool cloth = r.longest != 0;
    table.add({r.scene, std::to_string(r.count), r.program, short_number(1e3 * r.h),
               short_number(1e6 * r.seconds), short_number(1e-6 * r.count / r.seconds),
               short_number(r.seconds / r.h), cloth ? std::to_string(r.inside) : "",
               cloth ? short_number(1e3 * r.deepest) : "",
               cloth ? short_number(100 * r.longest) : "",
               cloth ? "" : short_number(1e3 * r.creep)});
  }
  if (results.empty()) return table;
  table.note(
      "M/s: million particle-steps (box-steps) a second; s a second: time that a second of the "
      "scene takes. Bullet takes steps of its own size on the cloth, and keeps the lengths of "
      "springs as far as its iterations do, whatever their stiffness.");
  table.note(
      "inside, deepest: particles within the sphere after 1 s; strain: of the longest spring "
      "then; creep: the farthest that a box has moved in 10 s.");
  return table;
}

}  // namespace sim_bench
