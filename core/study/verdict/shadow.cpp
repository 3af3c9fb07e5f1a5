#include "core/study/verdict/shadow.h"

#include <algorithm>
#include <numbers>

#include "core/base/array.h"
#include "core/base/noise.h"
#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/study/accuracy/companion.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr std::size_t kMostFrames = 100, kMostNumbers = std::size_t{1} << 22;  // kept of a run
constexpr double kWrong = 0.02;        // of the scene's size
constexpr double kWrongEnergy = 0.01;  // of the energy in play
constexpr double kNeighbour = 1e-7;    // of the size
constexpr double kChaos = 1e5;         // growth of a disturbance
constexpr int kFinestStates = 200;     // that an adaptive shadow shows, at least

// Of every particle, pinned or not, or the numbers of a flat state.
std::vector<double> places(Simulation& system) {
  if (!system.second_order()) return {system.state().begin(), system.state().end()};
  const ParticleView p = particles_of(system)->view(system.t(), system.state().data());
  std::vector<double> values(static_cast<std::size_t>(3 * p.n));
  double* next = values.data();
  for (int i = 0; i < p.n; ++i)
    for (const double* axis : {p.x, p.y, p.z}) *next++ = axis[i];
  return values;
}

// Largest distance of a particle, or difference of a number of a flat state.
double largest_distance(const std::vector<double>& a, const std::vector<double>& b, bool flat) {
  double most = 0;
  const std::size_t width = flat ? 1 : 3;
  for (std::size_t i = 0; i < a.size(); i += width) {
    double square = 0;
    for (std::size_t k = i; k < i + width; ++k) square += (a[k] - b[k]) * (a[k] - b[k]);
    const double distance = std::sqrt(square);
    if (!(distance <= most)) most = distance;  // not a number counts as the worst
  }
  return std::isnan(most) ? HUGE_VAL : most;
}

std::string metres(double length) {
  if (length < 0.1 && length >= 1e-3) return brief(100 * length, 2) + " cm";
  return brief(length, 2) + " m";
}

}  // namespace

Shadow::Shadow(const SystemSpec& spec, Simulation& run, std::int64_t steps, Registry& registry)
    : spec_(&spec),
      run_(&run),
      registry_(&registry),
      start_(run.snapshot()),
      last_step_(run.step_count() + steps) {
  const auto numbers = std::max<std::size_t>(1, run.state().size());
  const auto most = std::clamp<std::size_t>(kMostNumbers / numbers, 4, kMostFrames);
  constexpr std::int64_t kLooks = 100;
  stride_ = std::max<std::int64_t>(1, kLooks / static_cast<std::int64_t>(most));
}

void Shadow::look(const Energy* energy, std::span<const double> observed) {
  if (energy) {
    if (frames_.empty()) start_potential_ = energy->potential;
    in_play_ = std::max(in_play_, energy->kinetic + std::abs(energy->potential - start_potential_));
  }
  if (looks_++ % stride_ != 0 && run_->step_count() != last_step_) return;
  frames_.push_back({run_->step_count(),
                     run_->t(),
                     places(*run_),
                     energy ? energy->total() : std::nan(""),
                     {observed.begin(), observed.end()}});
}

// The same run from its first state, with finer settings: `steps_per_step` steps for each of its
// own.
Simulation Shadow::finer_run(double& steps_per_step) const {
  const Settings& own = run_->settings();
  const auto taken = static_cast<double>(frames_.back().step - frames_.front().step);
  steps_per_step = run_->integrator_info().adaptive
                       ? std::clamp(std::ceil(kFinestStates / taken), 1.0, double(kFinestStates))
                       : finer_steps(taken);
  return study::finer_run(*spec_, *registry_, own, steps_per_step, start_.t(), start_.x);
}

// Two for each step that the method takes; more where there are so few that two are no finer look
// at what happens. A method that chooses its steps inside ours tells by its evaluations.
double Shadow::finer_steps(double taken) const {
  constexpr double kFewest = 64, kMost = 32;
  const int each = run_->integrator_info().evaluations;
  const auto evaluations = static_cast<double>(run_->integrator().effort().evaluations);
  const double inside = each > 0 ? std::max(1.0, std::round(evaluations / (each * taken))) : 1;
  return 2 * inside * std::clamp(std::ceil(kFewest / (2 * inside * taken)), 1.0, kMost);
}

// The extent of the scene, then or at the start; of a single point how far it has come, of numbers
// the largest.
double Shadow::size_at(const Frame& frame) const {
  const Frame& first = frames_.front();
  double size = 0;
  if (run_->flat()) {
    for (const Frame* each : {&first, &frame})
      for (const double value : each->x) size = std::max(size, std::abs(value));
    return size;
  }
  for (const Frame* each : {&first, &frame})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double low = HUGE_VAL, high = -HUGE_VAL;
      for (std::size_t i = axis; i < each->x.size(); i += 3) {
        low = std::min(low, each->x[i]);
        high = std::max(high, each->x[i]);
      }
      size = std::max(size, high - low);
    }
  if (size > 0) return size;
  for (const Frame& each : frames_) {
    size = std::max(size, largest_distance(each.x, first.x, false));
    if (&each == &frame) break;
  }
  if (!run_->second_order())
    size = std::max(size, largest_distance(frame.x, std::vector(frame.x.size(), 0.0), false));
  return size;
}

void Shadow::compare_frame(const Frame& frame, double factor, Simulation& shadow,
                           Parting& result) const {
  const double error = factor * largest_distance(frame.x, places(shadow), run_->flat());
  const double size = size_at(frame);
  const double share = size > 0 ? error / size : error > 0 ? HUGE_VAL : 0;
  if (!(error <= result.error)) result.error = error;
  if (!(share <= result.share)) result.share = share;
  if (share > kWrong) result.horizon = std::min(result.horizon, frame.t);
  result.at_end = error;
  if (!frame.observed.empty()) {
    const std::vector<double> observed = spec_->observe(shadow);
    result.observed.resize(observed.size());
    for (std::size_t i = 0; i < observed.size(); ++i) {
      Parted& parted = result.observed[i];
      parted.at_end = std::abs(frame.observed[i] - observed[i]);
      if (!(parted.at_end <= parted.most)) parted.most = parted.at_end;
    }
  }
  const double moved = largest_distance(frame.x, frames_.front().x, run_->flat());
  if (!run_->second_order() || !(in_play_ > 0)) return;
  if (moved <= at_rest(run_->integrator_info()) * size) return;
  const double energy = std::abs(frame.energy - shadow.energy().total()) / in_play_;
  if (!(energy <= result.energy)) result.energy = energy;
}

// The last step of a run may be shorter than the others; its part of the finer run is then cut as
// many times.
bool Shadow::take(Simulation& finer, double steps_per_step, std::size_t frame,
                  const std::function<bool()>& stop, const std::function<void()>& each) const {
  const Frame &from = frames_[frame - 1], &to = frames_[frame];
  const auto steps = static_cast<double>(to.step - from.step), h = run_->h();
  const bool cut = to.t < from.t + (steps - 1e-6) * h;
  const auto run = [&](double count) {
    for (auto left = static_cast<std::int64_t>(count); left > 0;) {
      const int taken = stop() ? 0 : finer.steps(each ? 1 : left);
      if (taken == 0) return false;
      left -= taken;
      if (each) each();
    }
    return true;
  };
  if (!cut) return run(steps_per_step * steps);
  if (!run(steps_per_step * (steps - 1))) return false;
  finer.set_dt((to.t - finer.t()) / steps_per_step);
  return run(steps_per_step);
}

Parting Shadow::compare(double strain, const std::function<bool()>& stop) {
  Parting result;
  if (frames_.size() < 2) return result;
  double finer = 1;
  Simulation shadow = finer_run(finer);
  std::vector<std::vector<double>> path{frames_.front().x};
  // err = C tol, or C h^p: the difference to the shadow is err (1 - finer^-p).
  const IntegratorInfo info = run_->integrator_info();
  const double factor = info.adaptive ? kSharper / (kSharper - 1)
                                      : 1 / (1 - std::pow(finer, -std::max(1, info.order)));
  shadow.stop_when(stop);
  const bool watch_strain = run_->second_order() && run_->integrator_info().adaptive && finer > 1;
  std::vector<Course> courses(asked_.size());
  const auto follow = [&] {
    for (std::size_t i = 0; i < asked_.size(); ++i)
      courses[i].look(shadow.t(), asked_[i].at(shadow));
  };
  const auto watch = [&] {
    follow();
    if (!watch_strain) return;
    const StrainedSpring worst = worst_spring(shadow);
    if (worst.a >= 0 && !(std::abs(worst.strain) <= std::abs(result.strain.strain)))
      result.strain = worst;
  };
  const bool watches = watch_strain || !asked_.empty();
  follow();
  for (std::size_t k = 1; k < frames_.size(); ++k) {
    if (!take(shadow, finer, k, stop, watches ? watch : std::function<void()>())) {
      const bool stopped = stop() || shadow.divergence().status == StepStatus::kStopped;
      result.outcome = stopped ? Parting::Outcome::kStopped : Parting::Outcome::kShadowFailed;
      return result;
    }
    compare_frame(frames_[k], factor, shadow, result);
    path.push_back(places(shadow));
  }
  for (std::size_t i = 0; i < asked_.size(); ++i)
    result.figures.push_back(courses[i].figure(asked_[i]));
  result.outcome = Parting::Outcome::kCompared;
  // A spring that is pressed to a point may leave it on either side.
  constexpr double kPressed = 0.9;
  if (result.share > kWrong || -strain > kPressed) look_for_chaos(path, stop, result);
  if (!run_->second_order()) look_for_pulses(shadow, result);
  return result;
}

// A neighbour of the first state, 1e-7 of the size away, takes the steps of the shadow: how far
// they part over how far apart they began is the growth of a disturbance (Lyapunov 1892).
void Shadow::look_for_chaos(std::span<const std::vector<double>> path,
                            const std::function<bool()>& stop, Parting& result) const {
  double finer = 1;
  Simulation neighbour = finer_run(finer);
  neighbour.stop_when(stop);
  const double start = size_at(frames_.front());
  const double size = start > 0 ? start : size_at(frames_.back());
  Noise noise;
  for (int i = 0; i < (run_->flat() ? run_->components() : run_->particles()); ++i) {
    if (run_->flat()) {
      neighbour.set_component(i, neighbour.component(i) + kNeighbour * size * noise.next());
    } else if (!run_->second_order() || !neighbour.pinned(i)) {
      const Vec3 away(noise.next(), noise.next(), noise.next());
      neighbour.set_position(i, neighbour.position(i) + kNeighbour * size * away);
    }
  }
  const double apart = largest_distance(path.front(), places(neighbour), run_->flat());
  if (!(apart > 0)) return;
  constexpr double kMostRate = 700;  // 1/s, of what exp() can tell
  std::vector<double> growths;
  double most = 0;
  for (std::size_t k = 1; k < frames_.size() && take(neighbour, finer, k, stop); ++k) {
    const double growth = largest_distance(path[k], places(neighbour), run_->flat()) / apart;
    // The rate is that of growth, until the distance is as large as the scene lets it be.
    if (most * apart < 0.01 * size)
      result.rate =
          std::exp(std::min(kMostRate, std::log(growth) / (frames_[k].t - frames_.front().t)));
    most = std::max(most, growth);
    growths.push_back(growth);
  }
  // A jump that comes a little later parts neighbours while it lasts; chaos does not end.
  constexpr std::size_t kStays = 3;
  const std::size_t stays = std::min(kStays, growths.size());
  result.growth = 0;
  for (std::size_t k = 0; k < growths.size(); ++k) {
    const auto from =
        growths.begin() + static_cast<std::ptrdiff_t>(std::min(k, growths.size() - stays));
    const double growth = *std::min_element(from, from + static_cast<std::ptrdiff_t>(stays));
    result.growth = std::max(result.growth, growth);
    if (kNeighbour * growth > kWrong && result.horizon == HUGE_VAL)
      result.horizon = frames_[k + 1].t;
  }
}

// What depends on time alone can be so short that no stage of a step sees it. The right-hand side
// is asked at many times between two states, of the first of them: where it is far from all that it
// is at the states, its integral must be found in the way from one to the next.
void Shadow::look_for_pulses(Simulation& shadow, Parting& result) const {
  constexpr int kProbes = 20'000, kFine = 1000;
  constexpr double kFar = 3;
  OdeSystem& system = shadow.ode();
  const std::size_t n = system.size();
  Array y(n), rate(n), here(n);
  const auto rate_at = [&](double t, const Frame& frame, Array& out) {
    system.eval(t, {frame.x.data(), {}}, y.data(), out.data());
  };
  const auto largest = [&](const Array& values, const Array* other) {
    double most = 0;
    for (std::size_t i = 0; i < n; ++i)
      most = std::max(most, std::abs(values[i] - (other ? (*other)[i] : 0)));
    return most;
  };
  std::vector<double> sizes;
  for (const Frame& frame : frames_) {
    rate_at(frame.t, frame, rate);
    sizes.push_back(largest(rate, nullptr));
  }
  std::ranges::nth_element(sizes, sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2));
  const double usual = sizes[sizes.size() / 2];
  Noise noise;
  const int probes = std::max(1, kProbes / static_cast<int>(frames_.size()));
  for (std::size_t k = 0; k + 1 < frames_.size(); ++k) {
    const Frame &from = frames_[k], &to = frames_[k + 1];
    const double span = to.t - from.t;
    rate_at(from.t, from, here);
    double worst = kFar * usual, at = std::nan("");
    for (int i = 0; i < probes; ++i) {
      const double t = from.t + span * (i + noise.next() + 0.5) / probes;
      rate_at(t, from, rate);
      if (largest(rate, &here) > worst) {
        worst = largest(rate, &here);
        at = t;
      }
    }
    if (std::isnan(at)) continue;
    std::vector<double> impulse(n, 0.0);
    for (int i = 0; i < kFine; ++i) {
      rate_at(from.t + span * (i + noise.next() + 0.5) / kFine, from, rate);
      for (std::size_t c = 0; c < n; ++c) impulse[c] += span * (rate[c] - here[c]) / kFine;
    }
    for (std::size_t c = 0; c < n; ++c) {
      const double found = to.x[c] - from.x[c] - span * here[c];
      const double missing = std::abs(impulse[c] - found);
      if (std::abs(impulse[c]) > kWrong * size_at(to) && missing > 0.5 * std::abs(impulse[c]))
        result.missed_at = at;
    }
    if (!std::isnan(result.missed_at)) return;
  }
}

Finding finding_of(const Parting& parting, const Simulation& run) {
  using enum Parting::Outcome;
  const bool flat = run.flat();
  switch (parting.outcome) {
    case kNone:
      return {};
    case kStopped:
      return {Trust::kTrusted, "not verified: stopped"};
    case kShadowFailed:
      return {Trust::kSuspect, "the same run with half the step or a tenth of the tolerance fails"};
    case kCompared:
      break;
  }
  if (!std::isnan(parting.missed_at))
    return {Trust::kSuspect, "the right-hand side has a pulse near t = " +
                                 brief(parting.missed_at, 4) + " s that no step has seen"};
  const bool chaotic = parting.growth > kChaos;
  constexpr double kFast = 1e4;
  const std::string parting_rate =
      parting.rate < kFast
          ? "by x" + brief(parting.rate, 2) + " a second"
          : "tenfold within " + brief(std::numbers::ln10 / std::log(parting.rate), 2) + " s";
  const auto amount = [&](double error) { return flat ? brief(error, 2) : metres(error); };
  if (parting.share <= kWrong && !(chaotic && kNeighbour * parting.growth > kWrong)) {
    if (parting.energy > kWrongEnergy)
      return {Trust::kSuspect, "energy off by " + percent(parting.energy, 1, 2)};
    return {Trust::kTrusted, (flat ? "numbers to " + brief(parting.error, 1)
                                   : "positions to " + brief(parting.error, 1) + " m") +
                                 " (verified)"};
  }
  if (chaotic)
    return {Trust::kChaotic, std::string(flat ? "numbers" : "positions") +
                                 " are right until about t = " + brief(parting.horizon, 2) +
                                 " s (neighbours part " + parting_rate + ")"};
  const std::string share = ", " + percent(parting.share, 1, 2) + " of the size";
  if (2 * parting.at_end >= parting.error)
    return {Trust::kSuspect, "off by about " + amount(parting.at_end) + " by the end" + share};
  return {Trust::kSuspect, "off by up to " + amount(parting.error) + " on the way" + share};
}

}  // namespace sim::study
