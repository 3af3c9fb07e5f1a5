// Runs of scenes that no closed form judges, against finer runs by methods of two families.
#include <algorithm>
#include <functional>
#include <optional>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/study/run/track.h"
#include "core/study/verdict/refined_run.h"
#include "tests/hunt/hunt.h"
#include "tests/hunt/kind_runs.h"
#include "tests/hunt/kinds.h"
#include "tests/hunt/random_numbers.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

using sim::study::Trust;

constexpr int kFrames = 20;
constexpr double kWrongShare = 0.05;
// The share of an error, and of the size, by which two references may differ to be accepted.
constexpr double kKnown = 0.25, kKnownShare = 2e-4;

double extent(const State& x, std::size_t width) {
  double size = 0;
  for (std::size_t axis = 0; axis < width; ++axis) {
    double low = width == 1 ? 0 : HUGE_VAL, high = width == 1 ? 0 : -HUGE_VAL;
    for (std::size_t i = axis; i < x.size(); i += width) {
      low = std::min(low, x[i]);
      high = std::max(high, x[i]);
    }
    size = std::max(size, width == 1 ? std::max(-low, high) : high - low);
  }
  return size;
}

// The energy in play up to the last look, J.
class EnergyInPlay {
 public:
  void look(const sim::Energy& energy) {
    if (!start_) start_ = energy.potential;
    most_ = std::max(most_, energy.kinetic + std::abs(energy.potential - *start_));
  }
  double most() const { return most_; }

 private:
  std::optional<double> start_;
  double most_ = 0;
};

// A run that advances from frame to frame.
class Reference {
 public:
  Reference(const sim::SystemSpec& spec, const std::string& method, double dt, std::int64_t steps,
            sim::Registry& registry)
      : system_(spec, registry, {.integrator = method, .dt = dt}),
        steps_(steps),
        now_(sim::study::positions(system_)) {
    look();
  }
  // False where a step fails, or takes too long.
  bool advance(const Patience& patience) {
    constexpr std::int64_t kOften = 32;
    system_.stop_when([&] { return patience.over(); });
    for (std::int64_t left = steps_ / kFrames; left > 0;) {
      const int taken = patience.over() ? 0 : system_.steps(std::min(left, kOften));
      if (taken == 0) return false;
      left -= taken;
    }
    now_ = sim::study::positions(system_);
    look();
    return true;
  }
  const State& now() const { return now_; }
  const sim::Energy& energy() const { return energy_; }
  double in_play() const { return in_play_.most(); }

 private:
  void look() {
    if (!system_.second_order()) return;
    energy_ = system_.energy();
    in_play_.look(energy_);
  }

  sim::Simulation system_;
  std::int64_t steps_;
  State now_;
  sim::Energy energy_;
  EnergyInPlay in_play_;
};

// Explicit methods of two families, of those that the scene takes.
std::vector<std::string> references(const std::vector<std::string>& methods, bool imex) {
  std::vector<std::string> found;
  for (const char* family : {"rk4", imex ? "implicit_midpoint" : "verlet", "midpoint", "rk3",
                             "implicit_midpoint", "symplectic_euler"})
    if (std::ranges::count(methods, family) && !std::ranges::count(found, family) &&
        found.size() < 2)
      found.emplace_back(family);
  return found;
}

// The run as `sim` makes it, with what it looked like at each frame.
struct Judged {
  std::vector<State> states;
  std::vector<double> energies;  // J, total
  sim::study::Verdict verdict;
  bool whole = true, in_time = true;
};

Judged judge(const sim::SystemSpec& spec, const sim::RunOptions& options, std::int64_t steps,
             const Patience& patience, sim::Registry& registry) {
  sim::Simulation system(spec, registry, options);
  sim::study::Track track(spec, system, steps, sim::study::Track::kNever, steps / kFrames,
                          &registry);
  const std::function<bool()> stop = [&] { return patience.over(); };
  system.stop_when(stop);
  Judged found;
  const auto look = [&] {
    track.sample();
    if (!track.take_row(false)) return;
    found.states.push_back(sim::study::positions(system));
    found.energies.push_back(system.second_order() ? system.energy().total() : 0);
  };
  look();
  while (!track.finished() && !stop() && (found.whole = system.steps(track.due()) > 0)) look();
  found.in_time = !stop();
  if (!found.in_time) return found;
  if (found.whole)
    track.verify(stop);
  else
    track.mark_diverged();
  found.in_time = !stop();
  found.verdict = track.verdict();
  return found;
}

// The truth about a run that two references tell, frame by frame, until they agree no more or the
// run is wrong.
struct Told {
  double off = 0, energy = 0;     // of the run, shares of the size and of the energy in play
  double error = 0, unknown = 0;  // of the run, and of what is known of it
  int frames = 0;                 // known
  bool wrong = false;

  bool to_the_end() const { return frames == kFrames; }
};

Told tell(const Judged& judged, Reference rough, Reference sharp, std::size_t width,
          const Patience& patience) {
  Told told;
  const State start = sharp.now();
  double travel = 0;  // of a single point, in the whole run
  for (const State& each : judged.states) travel = std::max(travel, distance(each, start, width));
  while (!told.wrong && !told.to_the_end() && rough.advance(patience) && sharp.advance(patience)) {
    const auto k = static_cast<std::size_t>(told.frames + 1);
    const State& now = sharp.now();
    double size = std::max(extent(start, width), extent(now, width));
    if (size == 0 || width == 1) size = std::max({size, travel, 1e-12});
    const double unknown = distance(rough.now(), now, width);
    const bool failed = k >= judged.states.size();  // there is a solution, and the run has none
    const double apart = failed ? HUGE_VAL : distance(judged.states[k], now, width);
    if (unknown > std::max(failed ? 0 : kKnown * apart, kKnownShare * size)) break;
    ++told.frames;
    told.wrong = apart > kWrongShare * size;
    told.off = std::max(told.off, apart / size);
    told.error = std::max(told.error, apart);
    told.unknown = std::max(told.unknown, unknown);
    if (sharp.in_play() > 0 && !failed)
      told.energy = std::max(
          told.energy, std::abs(judged.energies[k] - sharp.energy().total()) / sharp.in_play());
  }
  return told;
}

}  // namespace

Case hunt_one(const HuntKind& kind, std::uint64_t seed, sim::Registry& registry) {
  Case found;
  found.seed = seed;
  found.words = kind.name;
  const Patience patience;
  try {
    const sim::SystemSpec spec = system_of(kind.scene(seed), registry);
    const std::size_t width = spec.first_order && spec.first_order->dimension == 1 ? 1 : 3;
    Random random(seed + 1'000'003);
    std::vector<std::string> methods = methods_for(spec, registry);
    const bool imex = std::string(kind.name) == "imex";
    const std::vector<std::string> two = references(methods, imex);
    if (two.size() < 2) throw sim::Error(sim::ErrorKind::kInternal, {"no reference", "", "", ""});
    sim::Simulation(spec, registry, {.integrator = two[0], .dt = spec.dt});  // throws what is wrong
    std::string method;
    for (bool fits = false; !fits;) {
      method = methods[static_cast<std::size_t>(
          random.integer(0, static_cast<int>(methods.size()) - 1))];
      if (imex && std::ranges::count(methods, "imex")) method = "imex";
      fits = can_run(spec, method, registry);
    }
    sim::RunOptions options{.integrator = method, .dt = spec.dt};
    const sim::IntegratorInfo info = info_of(method, registry);
    const auto& plugin = registry.get<sim::Integrator>(method);
    const bool tolerance =
        info.adaptive && std::ranges::any_of(plugin.params, [](const sim::Param& param) {
          return param.name == "tol";
        });
    if (tolerance) options.integrator.given["tol"] = random.decade(-6, -2);
    options.dt *= random.decade(-0.5, 0.6);
    const auto steps = std::max<std::int64_t>(
        kFrames, kFrames * std::llround(spec.duration / options.dt / kFrames));
    found.words += ", " + method;
    for (const auto& [name, value] : options.integrator.given)
      found.words += ":" + name + "=" + sim::to_text(value);
    found.words += ", " + std::to_string(steps) + " steps of " + sim::brief(options.dt, 4) + " s";

    const Judged judged = judge(spec, options, steps, patience, registry);
    found.set_aside = !judged.in_time;
    if (found.set_aside) return found;
    found.verdict = judged.verdict.trust;
    found.reason = judged.verdict.reason;
    const std::string& reason = found.reason;
    found.mesh = found.verdict == Trust::kSuspect && reason.find("cell") != std::string::npos &&
                 reason.find("; ") == std::string::npos;

    // Finer, where the two do not agree on an error as small as that of the run. The second takes
    // other steps: what both get wrong alike, as moving surfaces, differs then.
    Told told;
    constexpr std::int64_t kMostSteps = 8'000;
    constexpr int kOther = 4;
    for (const int finer : {6, 24}) {
      const int times = std::max(
          1, static_cast<int>(std::ceil(finer * options.dt / std::max(options.dt, spec.dt))));
      if (finer > 6 && steps * times > kMostSteps) break;
      const auto run = [&](const std::string& name, int parts) {
        return Reference(spec, name, options.dt / parts, steps * parts, registry);
      };
      told = tell(judged, run(two[0], times), run(two[1], kOther * times), width, patience);
      if (told.to_the_end() || told.wrong) break;
    }
    found.off = told.off;
    found.energy = told.energy;
    found.set_aside = patience.over() && !told.wrong && !told.to_the_end();
    if (told.wrong)
      found.truth = Truth::kWrong;
    else if (told.to_the_end())
      found.truth =
          told.off < kRightOfKinds && told.energy < kRightOfKinds ? Truth::kRight : Truth::kBetween;
    const double horizon = judged.verdict.figures.shadow.horizon;
    found.late = found.verdict == Trust::kChaotic && told.wrong &&
                 horizon > 1.1 * options.dt * static_cast<double>(steps / kFrames * told.frames);
    constexpr double kRounding = 1e-9;  // of the size
    if (found.truth != Truth::kUnknown && told.off > kRounding &&
        told.unknown <= kKnown * told.error)
      found.told = judged.verdict.figures.shadow.error / told.error;
  } catch (const sim::Error& failure) {
    found.failed = failure.what();
    found.truth = Truth::kUnknown;
  }
  return found;
}

}  // namespace sim_test
