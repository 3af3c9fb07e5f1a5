#include "tests/bench/fluid_peers.h"

#include <algorithm>
#include <cmath>
#include <iostream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "tests/bench/child.h"
#include "tests/bench/kernel.h"

namespace sim_bench {
namespace {

constexpr const char* kPython = "/usr/bin/python3";  // whose packages Debian's are
constexpr double kWidth = 0.2, kHeight = 0.4, kLength = 0.8, kMoment = 0.2;  // m, s
constexpr double kPeerStep = 0.5;  // of ours: it is not stable with that
constexpr int kWallLayers = 3;     // of particles of the peer: what its kernel reaches

bool has_pysph() { return Child({kPython, "-c", "import pysph"}, "/dev/null").wait() == 0; }

// tests/bench/peers/pysph_dam.py
class PySph {
 public:
  PySph(int dimensions, double spacing, double sound, double h)
      : program_({kPython, "-B", SIM_BENCH_SOURCE "/tests/bench/peers/pysph_dam.py",
                  std::to_string(dimensions), sim::shortest(spacing), sim::shortest(kWidth),
                  sim::shortest(kHeight), sim::shortest(kWidth), sim::shortest(kLength),
                  sim::shortest(sound), sim::shortest(h), std::to_string(kWallLayers)},
                 "/dev/null") {
    const std::string about = line();
    const auto bar = about.find('|');
    const auto gap = about.find(' ', std::min(bar, about.size()));
    if (gap == std::string::npos) fail();
    result_.program = about.substr(0, bar);
    result_.water = static_cast<int>(number(about.substr(bar + 1, gap - bar - 1)));
    result_.walls = static_cast<int>(number(about.substr(gap + 1)));
  }

  const FluidResult& about() const { return result_; }
  double run(long steps) {
    program_.write("run " + std::to_string(steps) + "\n");
    return number(line());
  }
  double front() {
    program_.write("front\n");
    return number(line());
  }

 private:
  [[noreturn]] static void fail() {
    throw sim::Error(sim::ErrorKind::kIo, {"peer pysph", "", "it ended before its answer",
                                           "run tests/bench/peers/pysph_dam.py by hand"});
  }
  std::string line() {
    const auto text = program_.read_line();
    if (!text) fail();
    return *text;
  }
  static double number(const std::string& text) {
    const auto value = sim::parse_number(text);
    if (!value) fail();
    return *value;
  }

  Child program_;
  FluidResult result_;
};

void measure_dam(int dimensions, const std::string& layers, const Options& options,
                 sim::Registry& registry, std::vector<FluidResult>& results) {
  sim::SceneOptions scene;
  scene.search_path = {SIM_BENCH_SCRIPTS};
  scene.settings = {{"layers", layers}, {"depth", dimensions == 2 ? "0" : "0.2"}};
  const sim::SystemSpec spec = sim::load_scene("scenes/dam.lua", registry, scene).systems.front();
  sim::Simulation ours(spec, registry, {});
  const double spacing = kWidth / std::stod(layers);
  const double sound = std::get<double>(spec.forces[1].given.at("speed_of_sound"));
  PySph peer(dimensions, spacing, sound, kPeerStep * ours.h());

  FluidResult its = peer.about();
  FluidResult own{.program = "sim, verlet", .water = ours.particles()};
  its.dimensions = own.dimensions = dimensions;
  own.h = ours.h();
  its.h = kPeerStep * own.h;
  const long steps = std::lround(kMoment / own.h);
  peer.run(std::lround(kMoment / its.h));
  its.front = peer.front() / kWidth;
  contestant(ours).run(steps);
  for (int i = 0; i < ours.particles(); ++i)
    own.front = std::max(own.front, ours.position(i).x() / kWidth);
  const std::vector<Times> times = measure(
      {{[&peer](long count) { return peer.run(count); }}, contestant(ours)}, options.timing);
  its.seconds = times[0].median;
  own.seconds = times[1].median;
  results.insert(results.end(), {its, own});
}

}  // namespace

std::vector<FluidResult> measure_fluid(const Options& options, sim::Registry& registry,
                                       std::vector<std::string>& notes) {
  std::vector<FluidResult> results;
  if (!has_pysph()) {
    notes.push_back("pysph is missing: apt-get install --no-install-recommends python3-pysph");
    return results;
  }
  std::cerr << "bench: pysph, a dam that breaks\n";
  measure_dam(2, "40", options, registry, results);
  measure_dam(3, "10", options, registry, results);
  return results;
}

Table fluid_table(const std::vector<FluidResult>& results) {
  Table table("fluid", "A dam that breaks in another program, one thread, in turns with ours",
              {{"dimensions", "dimensions"},
               {"program", "program", false},
               {"water", "water"},
               {"walls", "walls"},
               {"step, ms", "ms_of_step"},
               {"us/step", "us_per_step"},
               {"M/s", "million_steps_per_s"},
               {"s a second", "seconds_per_second"},
               {"front", "front"}});
  for (const FluidResult& r : results)
    table.add({std::to_string(r.dimensions), r.program, std::to_string(r.water),
               std::to_string(r.walls), short_number(1e3 * r.h), short_number(1e6 * r.seconds),
               short_number(1e-6 * r.water / r.seconds), short_number(r.seconds / r.h),
               short_number(r.front)});
  if (results.empty()) return table;
  table.note(
      "scenes/dam.lua with h = 1.5 spacings and Wendland's kernel, one evaluation of forces a step "
      "in both; the peer is not stable with our step. M/s: million particle-steps a second, of "
      "water; its walls are particles, ours are mirrors. s a second: time that a second of the "
      "scene takes. front: of the water after " +
      short_number(kMoment) + " s, in widths of the column.");
  return table;
}

}  // namespace sim_bench
