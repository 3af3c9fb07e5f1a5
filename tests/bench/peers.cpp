#include "tests/bench/peers.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "tests/bench/cloth.h"
#include "tests/bench/kernel.h"
#include "tests/bench/peer.h"
#include "tests/bench/peer_scene.h"

namespace sim_bench {
namespace {

namespace fs = std::filesystem;

constexpr int kGasSides[] = {10, 40, 80};  // 1000, 64000 and 512000 particles

double rms_distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(3 * sum / static_cast<double>(a.size()));
}

// Runs both from the start, the same steps of the same size.
void compare(Peer& peer, sim::Simulation& ours, PeerResult& result) {
  const long count = ours.particles() > 100000 ? 20 : 200;
  ours.reset();
  const std::vector<double> start = positions_of(ours);
  contestant(ours).run(count);
  const std::vector<double> mine = positions_of(ours);
  const std::vector<double> theirs = peer.positions_after(count, mine.size());
  const double way = rms_distance(mine, start);
  result.difference = rms_distance(mine, theirs) / way;

  // The positions, of order 1 m, are rounded to 1e-16 a step whatever the way.
  constexpr double kRounding = 1e-15;
  constexpr double kDragOverMass = 2;  // 1/s
  const bool gas = ours.name() == "gas";
  switch (gas ? Accuracy::kSame : peer.kind().accuracy) {
    case Accuracy::kSame:
      result.bound = gas ? 1e-10 : 1e-9;
      break;
    case Accuracy::kThirdOrder:
      result.bound = 1e-4;
      break;
    case Accuracy::kOtherDrag:
      result.bound = 2 * kDragOverMass * ours.h();
      break;
    case Accuracy::kOtherSplit:
      result.bound = 0.1 * kDragOverMass * ours.h();
      break;
  }
  result.bound += kRounding / way;
}

std::vector<sim::Simulation> make_ours(const sim::SystemSpec& spec, const std::string& method,
                                       const Options& options, sim::Registry& registry, double h) {
  std::vector<sim::Simulation> ours;
  const auto known = registry.names<sim::Integrator>();
  if (std::find(known.begin(), known.end(), method) == known.end()) return ours;
  for (const int threads : options.threads)
    ours.emplace_back(spec, registry,
                      sim::RunOptions{.integrator = method, .dt = h, .threads = threads});
  return ours;
}

struct Contest {
  int n;               // particles a side
  std::string method;  // of ours
  sim::SystemSpec spec;
  double h;  // s
  std::vector<PeerKind> kinds;
};

// Each peer is timed against ours alone: A B A B ...
void measure_contest(const Contest& contest, const Options& options, sim::Registry& registry,
                     PeerReport& report) {
  const auto& [n, method, spec, h, kinds] = contest;
  std::vector<sim::Simulation> ours = make_ours(spec, method, options, registry, h);
  const fs::path scene = peer_folder() / "scene.txt";
  {
    const sim::Simulation plain(spec, registry, {.dt = h});
    write_scene(scene, spec, plain);
  }
  for (const PeerKind& kind : kinds) {
    std::cerr << "bench: " << kind.name << ", " << spec.name << ", n = " << n << "\n";
    PeerResult& result = report.results.emplace_back();
    result.n = n;
    result.particles = spec.particles->count();
    result.name = spec.name == "cloth" ? kind.name : kind.name + ", " + spec.name;
    result.method = method;
    Peer peer(kind, scene);
    report.notes.push_back("n = " + std::to_string(n) + " " + result.name + ": " + peer.about());
    if (!ours.empty()) compare(peer, ours.front(), result);

    std::vector<Contestant> contestants = {{[&peer](long count) { return peer.run(count); }}};
    for (sim::Simulation& simulation : ours) contestants.push_back(contestant(simulation));
    const std::vector<Times> times = measure(contestants, options.timing);
    result.peer = times[0];
    result.ours.assign(times.begin() + 1, times.end());
    if (!ours.empty()) result.threads = options.threads;
  }
  fs::remove(scene);
}

}  // namespace

PeerReport measure_peers(const Options& options, sim::Registry& registry) {
  PeerReport report;
  const std::vector<PeerKind> kinds = build_peers(options.simd, report.notes);
  for (const int n : options.sizes)
    for (const std::string method : {"rk4", "verlet"}) {
      Contest cloth{n, method, load_cloth(n, registry), stable_step(method, n), {}};
      for (const PeerKind& kind : kinds)
        if (kind.method == method && n <= kind.largest) cloth.kinds.push_back(kind);
      measure_contest(cloth, options, registry, report);
    }
  for (const int n : kGasSides) {
    if (options.quick && n > 40) continue;
    Contest gas{n, "verlet", load_gas(n, registry), 0.005, {}};
    std::ranges::copy_if(kinds, std::back_inserter(gas.kinds), &PeerKind::gas);
    measure_contest(gas, options, registry, report);
  }
  report.contact = measure_contact(kinds, options, registry);
  report.fluid = measure_fluid(options, registry, report.notes);
  return report;
}

Table peer_table(const PeerReport& report) {
  Table table("peers", "The same scene in other programs, one thread, in turns with ours",
              {{"n", "n"},
               {"peer", "peer", false},
               {"ours", "method", false},
               {"its us/step", "peer_us_per_step"},
               {"M/s", "peer_million_steps_per_s"},
               {"threads", "threads"},
               {"our us/step", "ours_us_per_step"},
               {"M/s", "ours_million_steps_per_s"},
               {"ratio", "ratio"},
               {"difference", "relative_difference"},
               {"bound", "bound"}});
  const auto exponent = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1e", value);
    return std::string(text);
  };
  for (const PeerResult& r : report.results) {
    std::vector<std::string> row = {std::to_string(r.n), r.name, r.method,
                                    short_number(r.peer.median * 1e6),
                                    short_number(r.million_steps(r.peer))};
    const std::string difference = r.difference < 0 ? "" : exponent(r.difference);
    const std::string bound = r.difference < 0 ? "" : exponent(r.bound);
    if (r.ours.empty()) {
      row.insert(row.end(), {"", "", "", "", difference, bound});
      table.add(row);
    }
    for (std::size_t i = 0; i < r.ours.size(); ++i) {
      std::vector<std::string> whole = row;
      whole.insert(whole.end(), {std::to_string(r.threads[i]), short_number(r.ours[i].median * 1e6),
                                 short_number(r.million_steps(r.ours[i])), short_number(r.ratio(i)),
                                 difference, bound});
      table.add(whole);
    }
  }
  table.note("M/s: million particle-steps a second; ratio: ours over the peer's one thread.");
  table.note(
      "difference: rms distance of the positions after 200 steps (20 of more than 1e5 "
      "particles) over the rms way from the start; bound: the peer's own accuracy, 1e-9 for "
      "the same method (1e-10 for the gas: n^3 particles of scenes/gas.lua, of density 0.8), 2 h "
      "c/m for drag put "
      "into the kick (LAMMPS), h c/m / 10 for drag "
      "that decays exactly (OpenMM), 1e-4 for SUNDIALS.");
  for (const std::string& note : report.notes) table.note(note);
  return table;
}

bool all_agree(const PeerReport& report) {
  return std::all_of(report.results.begin(), report.results.end(), [](const PeerResult& r) {
    return r.difference < 0 || r.difference <= r.bound;
  });
}

}  // namespace sim_bench
