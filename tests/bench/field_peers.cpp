#include "tests/bench/field_peers.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <sstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/scene/simulation.h"
#include "tests/bench/child.h"
#include "tests/bench/peer_build.h"

namespace sim_bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLongest = 0.3;   // s, of a run; a method that takes longer is left
constexpr double kLong = 0.03;     // s, of a run that one turn measures well enough
constexpr double kFill = 2e-3;     // s, of runs of one turn
constexpr double kFinest = 1e-13;  // tolerance
const std::vector<std::string> kMethods = {"dopri5", "dop853", "bdf", "esdirk43", "rodas4", "auto"};

// `number`: what the peers call that setting; tolerances are rtol (floor + |x|).
struct Problem {
  std::string scene;
  std::map<std::string, std::string> settings = {};
  double number = 0;
  double duration = 0;  // 0: that of the scene
  double floor = 1;
  bool stiff = false;  // explicit methods are not tried
};

bool is_explicit(const std::string& method) {
  const std::vector<std::string> names{"dopri5", "dop853", "cvode_adams", "fehlberg78",
                                       "bulirsch_stoer"};
  return method.starts_with("arkode_erk") || std::ranges::count(names, method) > 0;
}

const std::vector<Problem>& problems() {
  static const std::vector<Problem> all{
      {.scene = "lorenz", .duration = 10},  // then its errors have grown by e^9
      {.scene = "van_der_pol", .settings = {{"mu", "1"}}, .number = 1, .duration = 20},
      {.scene = "van_der_pol",
       .settings = {{"mu", "1000"}},
       .number = 1e3,
       .floor = 1e-3,
       .stiff = true},
      {.scene = "van_der_pol",
       .settings = {{"mu", "1e6"}},
       .number = 1e6,
       .floor = 1e-6,
       .stiff = true},
      {.scene = "robertson", .floor = 1e-6, .stiff = true},
      {.scene = "hires", .floor = 1e-4},
      {.scene = "oregonator", .floor = 1e-6, .stiff = true},
      {.scene = "pleiades"},
      {.scene = "arenstorf"},
      {.scene = "brusselator", .number = 200},
      {.scene = "brusselator2d", .number = 32},
      {.scene = "heat", .number = 100},
      {.scene = "gray_scott", .number = 128, .duration = 100},
      {.scene = "kuramoto", .number = 64}};
  return all;
}

std::string title_of(const Problem& problem) {
  std::string title = problem.scene;
  for (const auto& [name, value] : problem.settings) title += "_" + name + value;
  return title;
}

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Solved {
  bool done = false;
  double seconds = 0;
  long evaluations = 0;
  std::vector<double> x;
};

std::vector<double> numbers_of(const sim::Simulation& simulation) {
  std::vector<double> x;
  for (int i = 0; i < simulation.components(); ++i) x.push_back(simulation.component(i));
  return x;
}

// auto is told by the step at which states are wanted what is fast. Others are asked for the last
// state alone, so that nothing but the error makes their steps, and beside auto for as many.
constexpr int kStatesOfAuto = 100;

// Ours on a problem.
class Ours {
 public:
  Ours(sim::SystemSpec spec, sim::Registry& registry, double duration, double floor)
      : spec_(std::move(spec)), registry_(registry), duration_(duration), floor_(floor) {}

  Solved run(const std::string& method, int states, double rtol, double fill) {
    using Given = std::map<std::string, sim::Value>;
    const Given given = Given{{"rtol", rtol}, {"atol", rtol * floor_}};
    sim::RunOptions options{.integrator = {method, given}, .dt = duration_ / states};
    Solved best;
    std::unique_ptr<sim::Simulation> simulation;
    try {
      simulation = std::make_unique<sim::Simulation>(spec_, registry_, options);
    } catch (const sim::Error&) {  // finer than it takes
      return best;
    }
    double begin = 0;
    std::int64_t asked = 0;
    simulation->stop_when([&] {
      constexpr int kLook = 1024;  // the clock itself takes time
      return ++asked % kLook == 0 && processor_seconds() - begin > kLongest;
    });
    double spent = 0;
    long evaluations = 0;
    do {
      if (best.done) simulation->reset();
      begin = processor_seconds();
      while (simulation->t() < 0.999 * duration_)
        if (simulation->steps(states) == 0) return best;
      const double seconds = processor_seconds() - begin;
      const long now = simulation->integrator().effort().evaluations;
      spent += seconds;
      if (!best.done || seconds < best.seconds)
        best = {true, seconds, now - evaluations, numbers_of(*simulation)};
      evaluations = now;
    } while (spent < fill);
    return best;
  }

  // Seconds of so many steps.
  double steps(double h, long count) {
    sim::Simulation simulation(spec_, registry_, {.integrator = "rk4", .dt = h});
    const double begin = processor_seconds();
    for (long left = count; left > 0;) {
      const int taken = simulation.steps(left);
      if (taken == 0) return kInfinity;
      left -= taken;
    }
    return processor_seconds() - begin;
  }

 private:
  sim::SystemSpec spec_;
  sim::Registry& registry_;
  double duration_, floor_;
};

// tests/bench/peers/fields.h says how it talks.
class FieldPeer {
 public:
  explicit FieldPeer(const PeerKind& kind)
      : program_(kind.name.substr(kind.name.find('_') + 1)),
        log_(peer_log(kind).string()),
        child_({peer_binary(kind).string()}, log_) {
    about_ = line();
    std::istringstream names(ask("methods"));
    for (std::string name; names >> name;) methods_.push_back(name);
  }

  const std::string& program() const { return program_; }
  const std::string& about() const { return about_; }
  const std::vector<std::string>& methods() const { return methods_; }

  void take(const Problem& problem, double duration, const std::vector<double>& start) {
    std::string text = "task " + problem.scene + " " + sim::shortest(problem.number) + " " +
                       sim::shortest(duration) + " " + sim::shortest(problem.floor) + " " +
                       std::to_string(start.size());
    for (const double x : start) text += " " + sim::shortest(x);
    ask(text);
  }

  Solved run(const std::string& method, double rtol, double fill) {
    const std::string text =
        ask("run " + method + " " + sim::shortest(rtol) + " " + sim::shortest(fill));
    Solved solved;
    std::istringstream in(text);
    if (text == "failed" || !(in >> solved.seconds >> solved.evaluations)) return solved;
    for (double x = 0; in >> x;) solved.x.push_back(x);
    solved.done = true;
    return solved;
  }

  double steps(double h, long count) {  // s; infinity where it has no such method
    const std::string text = ask("steps " + sim::shortest(h) + " " + std::to_string(count));
    return sim::parse_number(text).value_or(kInfinity);
  }

 private:
  std::string line() {
    const auto text = child_.read_line();
    if (!text)
      throw sim::Error(sim::ErrorKind::kIo, {"peer " + program_, log_, "it ended before its answer",
                                             "see what it wrote there"});
    return *text;
  }
  std::string ask(const std::string& words) {
    child_.write(words + "\n");
    return line();
  }

  std::string program_, log_;
  Child child_;
  std::string about_;
  std::vector<std::string> methods_;
};

double distance(const std::vector<double>& x, const std::vector<double>& y, double floor) {
  double most = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    most = std::max(most, std::fabs(x[i] - y[i]) / (floor + std::fabs(y[i])));
  return most;
}

// A method on a problem with what it found, tolerance by tolerance.
struct Contender {
  FieldPeer* peer = nullptr;  // null: ours
  FieldCurve curve;
  std::vector<std::vector<double>> found;
};

Solved run(Contender& contender, Ours& ours, double rtol) {
  return contender.peer ? contender.peer->run(contender.curve.method, rtol, kFill)
                        : ours.run(contender.curve.method, contender.curve.states, rtol, kFill);
}

// The result that another method confirms best, and how well.
std::pair<std::vector<double>, double> reference_of(const std::vector<Contender>& contenders,
                                                    double floor) {
  std::vector<double> best;
  double known = kInfinity;
  for (const Contender& a : contenders)
    for (const Contender& b : contenders) {
      if (a.curve.name() == b.curve.name() || a.found.empty() || b.found.empty()) continue;
      if (const double apart = distance(a.found.back(), b.found.back(), floor); apart < known) {
        known = apart;
        best = b.found.back();
      }
    }
  return {best, known};
}

FieldProblem measure_problem(const Problem& problem, const std::vector<double>& tolerances,
                             int turns, sim::Registry& registry,
                             std::vector<std::unique_ptr<FieldPeer>>& peers) {
  sim::SceneOptions scene;
  scene.search_path = {SIM_BENCH_SCRIPTS};
  scene.settings = problem.settings;
  const sim::SystemSpec spec =
      sim::load_scene("scenes/" + problem.scene + ".lua", registry, scene).systems.front();
  const sim::Simulation initial(spec, registry, {});
  const double duration = problem.duration > 0 ? problem.duration : initial.duration();
  const std::vector<double> start = numbers_of(initial);
  Ours ours(spec, registry, duration, problem.floor);

  std::vector<Contender> contenders;
  for (const std::string& method : kMethods)
    for (const int states : {1, kStatesOfAuto})
      if (states > 1 || method != "auto")
        contenders.push_back({nullptr, {"sim", method, {}, states}, {}});
  for (const auto& peer : peers) {
    peer->take(problem, duration, start);
    for (const std::string& method : peer->methods())
      contenders.push_back({peer.get(), {peer->program(), method, {}}, {}});
  }
  if (problem.stiff)
    std::erase_if(contenders, [](const Contender& c) { return is_explicit(c.curve.method); });
  for (Contender& contender : contenders)
    for (const double rtol : tolerances) {
      Solved solved = run(contender, ours, rtol);
      if (!solved.done) break;
      if (solved.seconds > kLongest) break;
      contender.curve.points.push_back({rtol, 0, solved.seconds, solved.evaluations});
      contender.found.push_back(std::move(solved.x));
    }
  for (int turn = 1; turn < turns; ++turn)
    for (Contender& contender : contenders)
      for (FieldPoint& point : contender.curve.points)
        if (point.seconds < kLong)
          point.seconds = std::min(point.seconds, run(contender, ours, point.rtol).seconds);

  FieldProblem result{title_of(problem), static_cast<int>(start.size()), 0, {}};
  const auto [reference, known] = reference_of(contenders, problem.floor);
  result.known = known;
  for (Contender& contender : contenders) {
    for (std::size_t i = 0; i < contender.found.size(); ++i)
      contender.curve.points[i].error = distance(contender.found[i], reference, problem.floor);
    result.curves.push_back(std::move(contender.curve));
  }
  return result;
}

// Least seconds of a few turns.
template <class Run>
double least(const Run& run) {
  constexpr int kTurns = 5;
  double seconds = kInfinity;
  for (int turn = 0; turn < kTurns; ++turn) seconds = std::min(seconds, run());
  return seconds;
}

std::vector<FieldSpeed> measure_speeds(sim::Registry& registry,
                                       std::vector<std::unique_ptr<FieldPeer>>& peers) {
  sim::SceneOptions scene;
  scene.search_path = {SIM_BENCH_SCRIPTS};
  std::vector<FieldSpeed> speeds;
  const auto load = [&](const std::string& name) {
    return sim::load_scene(name, registry, scene).systems.front();
  };
  const auto peer_of = [&](const std::string& name) -> FieldPeer* {
    for (const auto& peer : peers)
      if (peer->program() == name) return peer.get();
    return nullptr;
  };
  const auto start_of = [&](const sim::SystemSpec& spec) {
    return numbers_of(sim::Simulation(spec, registry, {}));
  };
  const auto steps_row = [&](const Problem& problem, const std::string& what, double h, long count,
                             double scale, const std::string& unit, const std::string& asked) {
    const sim::SystemSpec spec = load("scenes/" + problem.scene + ".lua");
    Ours ours(spec, registry, 1, 1);
    FieldSpeed speed{what, unit, scale * least([&] { return ours.steps(h, count); }), 0, asked};
    if (FieldPeer* const peer = peer_of("odeint")) {
      peer->take(problem, 1, start_of(spec));
      speed.peer = scale * least([&] { return peer->steps(h, count); });
    }
    speeds.push_back(speed);
  };
  constexpr long kLorenz = 100000, kGrayScott = 20;
  constexpr double kCells = 128 * 128;
  steps_row({.scene = "lorenz"}, "Lorenz, rk4, a step", 1e-3, kLorenz, 1e9 / kLorenz, "ns",
            "8 times odeint");
  steps_row({.scene = "gray_scott", .number = 128},
            "Gray-Scott 128 x 128, rk4, a cell and evaluation", 1, kGrayScott,
            1e9 / (4 * kGrayScott * kCells), "ns", "1 ns");

  // One system at one tolerance.
  const Problem line{.scene = "brusselator", .number = 200};
  const sim::SystemSpec formulas = load("scenes/brusselator.lua");
  const sim::SystemSpec lua = load(SIM_BENCH_SOURCE "/tests/bench/fields/brusselator.lua");
  double peer_seconds = 0;
  if (FieldPeer* const peer = peer_of("sundials")) {
    peer->take(line, 10, start_of(formulas));
    peer_seconds = 1e3 * least([&] { return peer->run("cvode_bdf", 1e-5, kFill).seconds; });
  }
  for (const auto* const spec : {&formulas, &lua}) {
    Ours ours(*spec, registry, 10, 1);
    speeds.push_back({std::string("Brusselator 2 x 200, bdf, tol 1e-5, ") +
                          (spec == &lua ? "Lua" : "formulas") + "; CVODE, band",
                      "ms", 1e3 * least([&] { return ours.run("bdf", 1, 1e-5, kFill).seconds; }),
                      peer_seconds, spec == &lua ? "5 times CVODE" : "2 times CVODE"});
  }
  return speeds;
}

}  // namespace

double seconds_to(const FieldCurve& curve, double error) {
  double best = kInfinity;
  const FieldPoint* before = nullptr;
  for (const FieldPoint& point : curve.points) {
    if (point.error <= error) {
      double seconds = point.seconds;
      if (before && before->error > error && before->seconds < point.seconds && point.error > 0) {
        const double share =
            std::log(before->error / error) / std::log(before->error / point.error);
        seconds = before->seconds * std::pow(point.seconds / before->seconds, share);
      }
      best = std::min(best, seconds);
    }
    before = &point;
  }
  return best;
}

FieldReport measure_fields(const Options& options, sim::Registry& registry,
                           std::vector<std::string>& notes) {
  const std::vector<PeerKind> kinds = build_peers(options.simd, notes, PeersOf::kFields);
  std::vector<std::unique_ptr<FieldPeer>> peers;
  FieldReport report;
  for (const PeerKind& kind : kinds) {
    peers.push_back(std::make_unique<FieldPeer>(kind));
    report.programs.push_back(peers.back()->about());
  }
  const int a_decade = options.quick ? 1 : 2, turns = options.quick ? 1 : 4;
  std::vector<double> tolerances;
  for (int n = 2 * a_decade; n <= 13 * a_decade; ++n)
    tolerances.push_back(std::max(kFinest, std::pow(10.0, -static_cast<double>(n) / a_decade)));
  for (const Problem& problem : problems()) {
    if (!options.only.empty() && title_of(problem).find(options.only) == std::string::npos)
      continue;
    std::cerr << "bench: " << title_of(problem) << "\n";
    report.problems.push_back(measure_problem(problem, tolerances, turns, registry, peers));
  }
  if (options.only.empty()) report.speeds = measure_speeds(registry, peers);
  return report;
}

}  // namespace sim_bench
