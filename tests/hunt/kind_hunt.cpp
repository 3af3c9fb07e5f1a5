// Runs of scenes that no closed form judges, against finer runs by methods of two families.
#include <algorithm>
#include <filesystem>
#include <fstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/study/run/track.h"
#include "core/study/verdict/refined_run.h"
#include "tests/hunt/hunt.h"
#include "tests/hunt/kinds.h"
#include "tests/hunt/random_numbers.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

using sim::study::Trust;
using State = std::vector<double>;

constexpr int kFrames = 20;
constexpr double kWrongShare = 0.05, kRightShare = 1e-3;
// The share of an error, and of the size, by which two references may differ to be accepted.
constexpr double kKnown = 0.25, kKnownShare = 2e-4;

double distance(const State& a, const State& b, std::size_t width) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); i += width) {
    double square = 0;
    for (std::size_t k = i; k < i + width; ++k) square += (a[k] - b[k]) * (a[k] - b[k]);
    const double apart = std::sqrt(square);
    if (!(apart <= most)) most = apart;
  }
  return std::isnan(most) ? HUGE_VAL : most;
}

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

// A path at equal times, shorter where a step fails, with energies in J where there are any.
struct Path {
  std::vector<State> states;
  std::vector<sim::Energy> energies;

  void take(sim::Simulation& system) {
    states.push_back(sim::study::positions(system));
    energies.push_back(system.second_order() ? system.energy() : sim::Energy());
  }
  // J, of the first so many.
  double in_play(std::size_t frames) const {
    double most = 0;
    for (std::size_t k = 0; k < std::min(frames, energies.size()); ++k)
      most = std::max(
          most, energies[k].kinetic + std::abs(energies[k].potential - energies[0].potential));
    return most;
  }
};

Path path_of(const sim::SystemSpec& spec, const sim::MethodChoice& method, double dt,
             std::int64_t steps, sim::Registry& registry) {
  sim::Simulation system(spec, registry, {.integrator = method, .dt = dt});
  Path path;
  path.take(system);
  for (int k = 0; k < kFrames && run(system, steps / kFrames); ++k) path.take(system);
  return path;
}

sim::SystemSpec load(const HuntKind& kind, std::uint64_t seed, sim::Registry& registry) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("hunt_" + std::string(kind.name) + std::to_string(seed) + ".lua");
  std::ofstream(file) << kind.scene(seed);
  sim::SceneSpec scene =
      sim::load_scene(file.string(), registry, {.search_path = {SIM_SOURCE_DIR "/scripts"}});
  std::filesystem::remove(file);
  return std::move(scene.systems.front());
}

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

struct Known {
  Path path;
  std::vector<double> unknown;  // at each frame
};

Known reference(const sim::SystemSpec& spec, const std::vector<std::string>& methods, double dt,
                std::int64_t steps, int finer, sim::Registry& registry) {
  Known known;
  const std::size_t width = spec.first_order && spec.first_order->dimension == 1 ? 1 : 3;
  // With other steps: what both get wrong alike, as moving surfaces, differs then.
  constexpr int kOther = 4;
  const Path other = path_of(spec, methods[0], dt / finer, steps * finer, registry);
  known.path = path_of(spec, methods[1], dt / (kOther * finer), kOther * steps * finer, registry);
  const auto &states = known.path.states, &others = other.states;
  for (std::size_t k = 0; k < std::min(states.size(), others.size()); ++k)
    known.unknown.push_back(distance(states[k], others[k], width));
  return known;
}

// Some refuse contact or constraints only when they meet them.
bool can_run(const sim::SystemSpec& spec, const std::string& method, sim::Registry& registry) {
  try {
    const sim::Simulation system(spec, registry, {.integrator = method, .dt = spec.dt});
  } catch (const sim::Error&) {
    return false;
  }
  return true;
}

struct Judged {
  Path path;
  sim::study::Verdict verdict;
  bool whole = true;
};

Judged judge(const sim::SystemSpec& spec, const sim::RunOptions& options, std::int64_t steps,
             sim::Registry& registry) {
  sim::Simulation system(spec, registry, options);
  sim::study::Track track(spec, system, steps, sim::study::Track::kNever, steps / kFrames,
                          &registry);
  Judged found;
  const auto look = [&] {
    track.sample();
    if (track.take_row(false)) found.path.take(system);
  };
  look();
  while (!track.finished() && (found.whole = system.steps(track.due()) > 0)) look();
  if (found.whole)
    track.verify([] { return false; });
  else
    track.mark_diverged();
  found.verdict = track.verdict();
  return found;
}

}  // namespace

Case hunt_one(const HuntKind& kind, std::uint64_t seed, sim::Registry& registry) {
  Case found;
  found.seed = seed;
  found.words = kind.name;
  try {
    const sim::SystemSpec spec = load(kind, seed, registry);
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

    const Judged judged = judge(spec, options, steps, registry);
    found.verdict = judged.verdict.trust;
    found.reason = judged.verdict.reason;

    // Finer, where the two do not agree on an error as small as that of the run.
    double error = 0, unknown = 0;
    bool known_to_the_end = false;
    std::size_t known_frames = 0;
    constexpr std::int64_t kMostSteps = 8'000;  // of a reference
    for (const int finer : {6, 24}) {
      const int times = std::max(
          1, static_cast<int>(std::ceil(finer * options.dt / std::max(options.dt, spec.dt))));
      if (finer > 6 && steps * times > kMostSteps) break;
      const Known known = reference(spec, two, options.dt, steps, times, registry);
      error = unknown = found.off = found.energy = 0;
      known_to_the_end = known.unknown.size() == kFrames + 1;
      known_frames = 0;
      for (std::size_t k = 1; k < std::min(known.unknown.size(), judged.path.states.size()); ++k) {
        const State &start = known.path.states[0], &now = known.path.states[k];
        const double size = std::max(
            {extent(start, width), extent(now, width), distance(now, start, width), 1e-12});
        const double apart = distance(judged.path.states[k], now, width);
        if (known.unknown[k] > std::max(kKnown * apart, kKnownShare * size)) {
          known_to_the_end = false;
          break;
        }
        known_frames = k;
        error = std::max(error, apart);
        unknown = std::max(unknown, known.unknown[k]);
        found.off = std::max(found.off, apart / size);
        if (const double in_play = known.path.in_play(k + 1); in_play > 0)
          found.energy = std::max(
              found.energy,
              std::abs(judged.path.energies[k].total() - known.path.energies[k].total()) / in_play);
      }
      if (known_to_the_end || found.off > kWrongShare) break;
    }
    const bool wrong = found.off > kWrongShare || (!judged.whole && known_to_the_end);
    if (found.verdict == Trust::kChaotic) {
      const double until = judged.verdict.figures.shadow.horizon;
      const double known_until =
          options.dt * static_cast<double>(steps) / kFrames * static_cast<double>(known_frames);
      found.late = wrong && until > 1.1 * known_until;
    }
    if (wrong)
      found.truth = Truth::kWrong;
    else if (known_to_the_end)
      found.truth =
          found.off < kRightShare && found.energy < kRightShare ? Truth::kRight : Truth::kBetween;
    constexpr double kRounding = 1e-9;  // of the size
    if (found.truth != Truth::kUnknown && found.off > kRounding && unknown <= kKnown * error)
      found.told = judged.verdict.figures.shadow.error / error;
  } catch (const sim::Error& failure) {
    found.failed = failure.what();
    found.truth = Truth::kUnknown;
  }
  return found;
}

}  // namespace sim_test
