#include "tests/bench/contact_peers.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>

#include "core/lua/scene/scene_file.h"
#include "tests/bench/cloth.h"
#include "tests/bench/kernel.h"
#include "tests/bench/peer.h"
#include "tests/bench/peer_scene.h"
#include "tests/support/all_intersections.h"

namespace sim_bench {
namespace {

constexpr double kStackTime = 10;  // s

struct ClothContest {
  std::string title;
  sim::SystemSpec spec;
  sim::RunOptions ours;
  double peer_step = 0;  // s
  double time = 0;       // s, from the start to where both are judged and timed
  double sample = 0;     // s, of one repeat, at least
};

ClothContest on_sphere(int n, sim::Registry& registry) {
  return {.title = "cloth on a sphere",
          .spec = with_sphere(load_cloth(n, registry), 0.001, 0.5),
          .ours = {.integrator = {"verlet"}, .dt = stable_step("verlet", n)},
          .peer_step = 0.004,
          .time = 1};
}

sim::SystemSpec load(const std::string& name, sim::Registry& registry,
                     const std::map<std::string, std::string>& settings = {}) {
  sim::SceneOptions scene;
  scene.search_path = {SIM_BENCH_SCRIPTS};
  scene.settings = settings;
  return sim::load_scene("scenes/" + name + ".lua", registry, scene).systems.front();
}

// When it lies in folds; a repeat is long enough for lists of near pairs to be made again.
ClothContest in_folds(int n, sim::Registry& registry) {
  constexpr double kPeerStep = 0.064;  // s, times n; at 1.5 times that it diverges
  return {.title = "cloth in folds",
          .spec = load("drape_self", registry, {{"n", std::to_string(n)}}),
          .ours = {},
          .peer_step = kPeerStep / n,
          .time = 0.4,
          .sample = 0.5};
}

// The depth of particles in the sphere, the lengths of springs, and the count of intersections.
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
  if (!spec.contact) return;
  std::vector<sim::Vec3> places;
  for (int i = 0; i < ours.particles(); ++i) places.push_back(at(i));
  result.crossings = sim_test::all_crossings(places, triangles_in_contact(spec));
}

void time_both(Peer& peer, sim::Simulation& ours, const TimingOptions& timing, ContactResult& its,
               ContactResult& own) {
  const std::vector<Times> times =
      measure({{[&peer](long count) { return peer.run(count); }}, contestant(ours)}, timing);
  its.seconds = times[0].median;
  own.seconds = times[1].median;
}

void measure_cloth(const PeerKind& kind, const ClothContest& contest, const Options& options,
                   sim::Registry& registry, std::vector<ContactResult>& results) {
  const sim::SystemSpec& spec = contest.spec;
  const std::filesystem::path scene = peer_folder() / "scene.txt";
  sim::Simulation ours(spec, registry, contest.ours);
  write_scene(scene, spec, sim::Simulation(spec, registry, {.dt = contest.peer_step}));
  Peer peer(kind, scene);
  const int n = ours.particles();
  ContactResult its{.scene = contest.title, .program = peer.about(), .count = n};
  ContactResult own{.scene = contest.title, .program = "sim, verlet", .count = n, .h = ours.h()};
  its.h = contest.peer_step;
  std::cerr << "bench: " << kind.name << ", " << contest.title << ", " << n << " particles\n";
  judge(ours, spec,
        peer.positions_after(std::lround(contest.time / its.h), 3 * static_cast<std::size_t>(n)),
        its);
  contestant(ours).run(std::lround(contest.time / own.h));
  judge(ours, spec, positions_of(ours), own);
  TimingOptions timing = options.timing;
  timing.seconds = std::max(timing.seconds, contest.sample);
  time_both(peer, ours, timing, its, own);
  results.insert(results.end(), {its, own});
}

void measure_stack(const PeerKind& kind, const Options& options, sim::Registry& registry,
                   std::vector<ContactResult>& results) {
  std::cerr << "bench: bullet, a stack of boxes\n";
  sim::Simulation ours(load("stack", registry), registry, {});
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
  time_both(peer, ours, options.timing, its, own);
  results.insert(results.end(), {its, own});
}

}  // namespace

std::vector<ContactResult> measure_contact(const std::vector<PeerKind>& peers,
                                           const Options& options, sim::Registry& registry) {
  std::vector<ContactResult> results;
  for (const PeerKind& kind : peers) {
    if (kind.name == "bullet") {
      for (const int n : {32, 128})
        measure_cloth(kind, on_sphere(n, registry), options, registry, results);
      measure_stack(kind, options, registry, results);
    }
    if (kind.name == "bullet_deformable")
      for (const int n : {64, 128})
        measure_cloth(kind, in_folds(n, registry), options, registry, results);
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
               {"crossings", "crossings"},
               {"creep, mm", "mm_creep"}});
  for (const ContactResult& r : results) {
    const bool cloth = r.longest != 0;
    table.add({r.scene, std::to_string(r.count), r.program, short_number(1e3 * r.h),
               short_number(1e6 * r.seconds), short_number(1e-6 * r.count / r.seconds),
               short_number(r.seconds / r.h), cloth ? std::to_string(r.inside) : "",
               cloth ? short_number(1e3 * r.deepest) : "",
               cloth ? short_number(100 * r.longest) : "",
               r.crossings < 0 ? "" : std::to_string(r.crossings),
               cloth ? "" : short_number(1e3 * r.creep)});
  }
  if (results.empty()) return table;
  table.note(
      "M/s: million particle-steps (box-steps) a second; s a second: time that a second of the "
      "scene takes. Bullet takes steps of its own size on the cloth, and keeps the lengths of "
      "springs as far as its iterations do, whatever their stiffness.");
  table.note(
      "inside, deepest: particles within the sphere after 1 s (in folds: 0.4 s); strain: of the "
      "longest spring then; creep: the farthest that a box has moved in 10 s.");
  table.note(
      "cloth in folds: scenes/drape_self.lua, timed from 0.4 s on. crossings: of edges and "
      "triangles that pass through each other then, looked for among all pairs. Of Bullet's ways "
      "only deformable bodies meet themselves, nodes against faces; its springs are as stiff as "
      "the mean of ours, with steps near the longest at which it does not diverge.");
  return table;
}

}  // namespace sim_bench
