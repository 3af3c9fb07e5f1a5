#include "core/study/verdict/verdict.h"

#include <algorithm>
#include <vector>

#include "core/base/array.h"
#include "core/base/text.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/limits/spectrum.h"
#include "core/study/limits/step_limit.h"

namespace sim::study {
namespace {

constexpr double kTolerance = 0.01;  // of the energy in play, of the exact solution, of the size
constexpr double kExplosion = 1e6;
constexpr double kUndampedShare = 0.8;  // of the stable step
constexpr int kMostProbes = 4, kMostStrains = 12;
constexpr double kStepsPerProbe = 150, kEvaluationsPerStrain = 130;  // so that they cost about 1 %
constexpr double kEvaluationsPerProduct = 750;
constexpr double kMomentum = 1e-9;
constexpr double kRounding = 1e-15, kNoWay = 1e-6;  // of the energies; of the size

std::string percent(double part, double whole = 1, int digits = 3) {
  return brief(whole > 0 ? 100 * part / whole : 0, digits) + " %";
}

double relative(double part, double whole) { return whole > 0 ? std::abs(part) / whole : 0; }

Vec3 momentum(Simulation& system) {
  const ParticleView p = particles_of(system)->view(system.t(), system.state().data());
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < p.n; ++i)
    if (p.free(i)) sum += p.mass[i] * p.velocity(i);
  return sum;
}

}  // namespace

const char* trust_name(Trust trust) {
  switch (trust) {
    case Trust::kTrusted:
      return "trusted";
    case Trust::kSuspect:
      return "suspect";
    case Trust::kDiverged:
      break;
  }
  return "diverged";
}

Deviation deviation(const SystemSpec& spec, const Simulation& system) {
  const StatePart& part = system.shape().first();
  const std::size_t axes = part.components.size(), numbers = part.count * axes;
  const std::vector<double> exact = spec.exact(system.t());
  if (exact.size() != numbers) return {std::nan(""), 0};
  Deviation result;
  for (std::size_t i = 0; i < numbers; ++i) {
    const double value = system.state()[part.at(i / axes, i % axes)];
    const double error = std::abs(value - exact[i]);
    if (!(error <= result.error)) result.error = error;
    result.size = std::max(result.size, std::abs(exact[i]));
  }
  return result;
}

Monitor::Monitor(const SystemSpec& spec, Simulation& system, std::int64_t steps, Registry* registry)
    : spec_(&spec), system_(&system), steps_(steps) {
  const auto enough_for = [&](double each, int most) {
    return static_cast<int>(std::clamp(static_cast<double>(steps) / each, 0.0, double(most)));
  };
  const int cost = std::max(1, system.integrator_info().evaluations);
  probes_ = registry ? enough_for(kStepsPerProbe, kMostProbes) : 0;
  // Where no step is unstable, or it is not known which are, only doubling shows one too long.
  const bool open =
      system.integrator_info().implicit || std::isnan(system.integrator().amplification(0.1, 0));
  if (registry && open) probes_ = std::max(probes_, 3);
  strains_ = std::max(1, enough_for(kEvaluationsPerStrain / cost, kMostStrains));
  if (probes_ > 0 && !system.integrator_info().adaptive) {
    doubled_ = std::make_unique<StepMap>(system.ode(), system.method().make());
  }
  size_ = scene_size(system);
  if (!system.second_order()) return;
  start_ = system.energy();
  balance_.emplace(system);
  const ParticleView p = particles_of(system)->view(system.t(), system.state().data());
  for (int i = 0; i < p.n; ++i)
    if (p.free(i)) mass_ += p.mass[i];
  start_momentum_ = momentum(system);
  start_t_ = system.t();
}

void Monitor::look(const Energy* energy) {
  if (energy && balance_) {
    if (looks_ > 0) balance_->look(*energy);
    const double change = energy->total() - start_.total();
    highest_ = std::max(highest_, change);
    largest_ = std::max(largest_, energy->kinetic + std::abs(energy->potential));
    const double moving = energy->kinetic + std::abs(energy->potential - start_.potential);
    if (start_scale_ == 0 && moving > 0)
      start_scale_ = moving + start_.kinetic + std::abs(start_.potential);
  }
  if (spec_->exact) look_at_exact();
  if (looks_ == 0) look_at_limit();
  ++looks_;
  // The other looks are spread over the run.
  const std::int64_t step = system_->step_count();
  const auto due = [&](int times, std::int64_t last) {
    return times > 0 && step > 0 && (last < 0 || step - last >= steps_ / times);
  };
  if (due(strains_, last_strain_)) look_at_strain();
  if (doubled_ && due(probes_, last_probe_)) double_a_step();
}

// The limit at the present state, from the bound on omega where that is good enough, or else from a
// few products with the Jacobian.
void Monitor::look_at_limit() {
  last_limit_ = system_->step_count();
  const IntegratorInfo info = system_->integrator_info();
  const Integrator& integrator = system_->integrator();
  if (info.adaptive || steps_ == 0 || std::isnan(integrator.amplification(0.1, 0))) return;
  const double affordable =
      static_cast<double>(steps_) * std::max(1, info.evaluations) / kEvaluationsPerProduct;
  const auto share_of = [&](const Vibration& mode) {
    return step_share(integrator, mode, system_->h());
  };
  StepShare found = share_of({omega_bound(*system_), smallest_damping(*system_)});
  const bool at_most = found.share <= kUndampedShare && affordable < 3;
  if (!at_most) {
    found = share_of(fastest_vibration(*system_, std::clamp(static_cast<int>(affordable), 4, 6)));
    if (found.share > 0.7) found = share_of(fastest_vibration(*system_, 40));
  }
  if (!(found.share <= figures_.dt_share)) {
    figures_.dt_share = found.share;
    figures_.at_most = at_most;
  }
  const double growth = static_cast<double>(steps_) * std::log(found.radius);
  if (!(growth <= figures_.growth)) figures_.growth = growth;
}

void Monitor::look_at_strain() {
  last_strain_ = system_->step_count();
  const StrainedSpring worst = worst_spring(*system_);
  if (worst.a >= 0 && !(std::abs(worst.strain) <= std::abs(figures_.strain.strain)))
    figures_.strain = worst;
}

// One step of h against two of h/2 from the present state: they differ by 1 - 2^-p of the error of
// the long one.
void Monitor::double_a_step() {
  last_probe_ = system_->step_count();
  const double t = system_->t(), h = system_->h();
  const double* x = system_->state().data();
  const std::size_t n = system_->state().size();
  Array whole(n), half(n), halves(n);
  if (!doubled_->step(t, h, x, whole.data()) || !doubled_->step(t, h / 2, x, half.data()) ||
      !doubled_->step(t + h / 2, h / 2, half.data(), halves.data()))
    return;
  double most = 0;
  const StatePart& part = system_->shape().first();
  for (std::size_t i = 0; i < part.count; ++i)
    for (std::size_t c = 0; c < part.components.size(); ++c)
      most = std::max(most, std::abs(whole[part.at(i, c)] - halves[part.at(i, c)]));
  const double error = most / (1 - std::ldexp(1.0, -system_->integrator_info().order));
  if (!(error <= figures_.step_error)) figures_.step_error = error;
}

void Monitor::look_at_exact() {
  const Deviation now = deviation(*spec_, *system_);
  // A comparison with nan is false: not-a-number counts as an infinite error.
  error_ = now.error <= error_ ? error_ : std::isnan(now.error) ? INFINITY : now.error;
  exact_size_ = std::max(exact_size_, now.size);
}

// |P - P(0) - M g t| over the largest momentum there could be, where nothing holds or brakes.
double Monitor::momentum_change() const {
  if (!balance_ || !balance_->complete() || balance_->has_drag() || system_->pinned_count() > 0)
    return std::nan("");
  const double* g = particles_of(*system_)->motion().gravity;
  const Vec3 expected =
      start_momentum_ + mass_ * (system_->t() - start_t_) * Vec3(g[0], g[1], g[2]);
  const double in_play =
      std::sqrt(2 * mass_ * std::max(balance_->in_play(), start_.kinetic)) + expected.norm();
  return relative((momentum(*system_) - expected).norm(), in_play);
}

std::string Monitor::energy_words(bool& suspect) const {
  const double scale = balance_->in_play(), error = balance_->error();
  const std::string whole = brief(scale, 3) + " J in play";
  const ParticleSystem& particles = *particles_of(*system_);
  if (!particles.other_forces().empty()) return "energy unchecked, for a force may add any";
  if (system_->ode().confined()) {
    suspect = balance_->rise() > kTolerance * scale;
    if (!suspect) return "energy did not rise, and what contact took is unchecked";
    return "energy rose by " + brief(balance_->rise(), 3) + " J, " +
           percent(balance_->rise(), scale) + " of the " + whole + ", though contact only takes";
  }
  // What is in play may be less than the rounding of the energies, as the motion less than that of
  // the coordinates. That is well where nothing goes anywhere.
  if (kRounding * largest_ > kTolerance * scale) {
    const double way = std::sqrt(2 * scale / mass_) * (system_->t() - start_t_);
    suspect = way > kNoWay * size_;
    return suspect ? "energies of " + brief(largest_, 3) + " J round away the " + whole
                   : "hardly anything moves";
  }
  const double size = std::abs(error), unknown = balance_->uncertainty();
  if (!(size - unknown > kTolerance * scale) && size + unknown > kTolerance * scale) {
    suspect = balance_->rise() > kTolerance * scale;
    return "energy rose by at most " + percent(balance_->rise(), scale) +
           (suspect ? " of the " + whole : "") + ", what drag took unchecked";
  }
  suspect = !(size <= kTolerance * scale);
  if (!suspect) return "energy to " + percent(size, scale, 1);
  if (error > 0)
    return "energy rose by " + brief(error, 3) + " J, " + percent(error, scale) + " of the " +
           whole + (balance_->has_drag() ? ", above what drag left" : "");
  return "energy fell by " + brief(-error, 3) + " J, " + percent(-error, scale) + " of the " +
         whole + (balance_->has_drag() ? ", below what drag left" : ", and no force takes any");
}

Verdict Monitor::verdict() {
  if (last_strain_ != system_->step_count()) look_at_strain();
  if (last_limit_ != system_->step_count()) look_at_limit();
  if (balance_ && balance_->complete() && std::isfinite(balance_->uncertainty()))
    figures_.energy =
        relative(std::abs(balance_->error()) + balance_->uncertainty(), balance_->in_play());
  figures_.momentum = momentum_change();
  if (start_scale_ > 0 && highest_ > kExplosion * start_scale_)
    return {Trust::kDiverged,
            "energy rose by " + brief(highest_, 3) + " J, from " + brief(start_scale_, 3) +
                " J at the start: the step is unstable",
            figures_};

  // What is wrong, and what is well; the first makes the verdict where there is any.
  std::vector<std::string> wrong, well;
  const auto say = [&](bool suspect, const std::string& words) {
    (suspect ? wrong : well).push_back(words);
  };
  if (spec_->exact)
    say(!(error_ <= kTolerance * exact_size_),
        "largest error " + brief(error_, 3) + " of a solution of size " + brief(exact_size_, 3));
  if (balance_) {
    bool suspect = false;
    const std::string words = energy_words(suspect);
    say(suspect, words);
  }
  const double share = figures_.dt_share;
  const bool undamped = balance_ && balance_->complete() && !balance_->has_drag();
  if (share > 1 && figures_.growth > 0.01)
    say(true, (share < 10 ? "dt is " + percent(share) + " of the largest stable one"
                          : std::string("no dt near this one is stable")) +
                  ", the fastest mode grows by e^" + brief(figures_.growth, 2) + " over the run");
  else if (share > 1)
    say(false, "no growth to see though dt is unstable");
  else if (undamped && share > kUndampedShare)
    say(true, "dt is " + percent(share) + " of the largest stable one, too near without drag");
  else if (share > 0)
    say(false, (figures_.at_most ? "dt < " : "dt ") + percent(share, 1, 2) + " of limit");
  if (figures_.strain.a >= 0) say(false, "strain " + percent(figures_.strain.strain, 1, 2));
  const std::string unit = system_->flat() ? "" : " m";
  if (figures_.step_error > kTolerance * size_)
    say(true, "one step is off by " + brief(figures_.step_error, 2) + unit);
  else if (figures_.step_error > 0)  // 0: the method chooses steps of its own within these
    say(false, "step error " + brief(figures_.step_error, 1) + unit);
  if (figures_.momentum > kMomentum)
    say(true, "momentum changed by " + percent(figures_.momentum) + " where it must hold");
  if (wrong.empty() && well.empty())
    well = {"all numbers stayed finite (nothing else was checked)"};

  std::string reason;
  for (const std::string& words : wrong.empty() ? well : wrong)
    reason += (reason.empty() ? "" : wrong.empty() ? ", " : "; ") + words;
  return {wrong.empty() ? Trust::kTrusted : Trust::kSuspect, reason, figures_};
}

}  // namespace sim::study
