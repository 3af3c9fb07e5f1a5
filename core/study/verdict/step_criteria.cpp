// The step: as a share of the largest stable one, and by its error.
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/array.h"
#include "core/base/text.h"
#include "core/math/elementary.h"
#include "core/particles/step_correction.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/limits/spectrum.h"
#include "core/study/limits/step_limit.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr double kUndampedShare = 0.8;          // of the stable step
constexpr double kVisibleGrowth = 0.01;         // natural logarithm, over the whole run
constexpr double kEvaluationsPerProduct = 750;  // so that products cost about 1 %
constexpr int kMostProbes = 4;
constexpr double kStepsPerProbe = 150;  // likewise

class LimitCriterion final : public Criterion {
 public:
  explicit LimitCriterion(const Watched& run)
      : system_(&run.system),
        steps_(run.steps),
        undamped_(run.system.second_order() && run.system.conserves_energy()) {}

  void look(const Energy* /*energy*/) override {
    if (last_ < 0) measure();
  }

  void conclude(Figures& figures, std::vector<Finding>& findings) override {
    if (last_ != system_->step_count()) measure();
    figures.dt_share = worst_.share;
    figures.growth = growth_;
    figures.at_most = at_most_;
    const double share = worst_.share;
    const std::string beyond = share < 10 ? "dt is " + percent(share) + " of the largest stable one"
                                          : std::string("no dt near this one is stable");
    if (share > 1 && growth_ > kVisibleGrowth)
      findings.push_back(
          {Trust::kSuspect,
           beyond + ", the fastest mode grows by e^" + brief(growth_, 2) + " over the run", true});
    else if (share > 1)
      findings.push_back({Trust::kTrusted,
                          beyond + ", but in this run the fastest mode grows by no more than " +
                              percent(std::expm1(std::max(0.0, growth_)), 1, 2),
                          true});
    else if (undamped_ && share > kUndampedShare)
      findings.push_back(
          {Trust::kSuspect,
           "dt is " + percent(share) + " of the largest stable one, too near without drag", true});
    else if (share > 0)
      findings.push_back(
          {Trust::kTrusted, (at_most_ ? "dt < " : "dt ") + percent(share, 1, 2) + " of limit"});
  }

 private:
  void measure();
  StepShare share_of_decay(double affordable) const;

  Simulation* system_;
  std::int64_t steps_, last_ = -1;
  bool undamped_, at_most_ = false;
  StepShare worst_{.share = std::nan("")};
  double growth_ = std::nan("");
};

// A light particle with drag may decay faster than anything vibrates: at most as fast as velocities
// by themselves and, if that is too fast for the step, by the eigenvalues.
StepShare LimitCriterion::share_of_decay(double affordable) const {
  if (system_->constraint_system()) return {};  // the rates leave out constraints
  const Integrator& integrator = system_->integrator();
  if (integrator.limiting_part()) return {};  // and implicit parts
  const VelocityDecay decay =
      velocity_decay(*system_, std::clamp(static_cast<int>(affordable), 4, 6));
  const double h = system_->h();
  if (integrator.info().needs_second_order) {
    const double share = h / kick_limit(integrator.info(), decay.forces);
    return {share, share > 1 ? 1 - 2 * share + 2 * share * share : 1};
  }
  const auto share_of = [&](double rate, double damping) {
    return step_share(integrator, {rate, damping}, h);
  };
  const double rate = std::max(decay.drag, decay.forces);
  if (!(rate > 0)) return {};
  StepShare worst = share_of(rate, 2 * rate);
  if (!(worst.share > kUndampedShare)) return worst;
  worst = {};
  for (const Vibration& each : spectrum(*system_).rates)
    if (each.damping >= 0)
      if (const StepShare found = share_of(each.omega, each.damping); found.share > worst.share)
        worst = found;
  return worst;
}

// The limit at the present state, from the bound on omega if that is good enough, or else from a
// few products with the Jacobian.
void LimitCriterion::measure() {
  last_ = system_->step_count();
  const IntegratorInfo info = system_->integrator_info();
  const Integrator& integrator = system_->integrator();
  if (info.adaptive || steps_ == 0 || std::isnan(integrator.amplification(0.1, 0))) return;
  const double affordable =
      static_cast<double>(steps_) * std::max(1, info.evaluations) / kEvaluationsPerProduct;
  // A vibration that grows by itself, as in a mechanism that moves, says nothing of the step.
  const auto share_of = [&](Vibration mode) {
    if (system_->second_order()) mode.damping = std::max(0.0, mode.damping);
    return step_share(integrator, mode, system_->h());
  };
  StepShare found = share_of({omega_bound(*system_), smallest_damping(*system_)});
  const bool at_most = found.share <= kUndampedShare && affordable < 3;
  if (!at_most) {
    found = share_of(limiting_vibration(*system_, std::clamp(static_cast<int>(affordable), 4, 6)));
    if (found.share > 0.7) found = share_of(limiting_vibration(*system_, 40));
  }
  bool decays = false;
  if (const StepShare decaying = share_of_decay(affordable); decaying.share > found.share) {
    found = decaying;
    decays = true;
  }
  if (!(found.share <= worst_.share)) {
    worst_ = found;
    at_most_ = at_most || decays;
  }
  const double growth = static_cast<double>(steps_) * elementary::log(found.radius);
  if (!(growth <= growth_)) growth_ = growth;
}

// Compares one step of h with two of h/2 occasionally: they differ by 1 - 2^-p of the error of the
// long one.
class SingleStepCriterion final : public Criterion {
 public:
  SingleStepCriterion(const Watched& run, int times)
      : system_(&run.system), size_(scene_size(run.system)), probes_(run.steps, times) {}

  void look(const Energy* /*energy*/) override {
    if (probes_.take(system_->step_count())) probe();
  }

  void touched() override { map_.reset(); }

  void conclude(Figures& figures, std::vector<Finding>& findings) override {
    figures.step_error = error_;
    const std::string unit = system_->flat() ? "" : " m";
    if (error_ > kTolerance * size_)
      findings.push_back({Trust::kSuspect, "one step is off by " + brief(error_, 2) + unit, true});
    else if (error_ > 0)  // 0: the method chooses steps of its own within these
      findings.push_back({Trust::kTrusted, "step error " + brief(error_, 1) + unit, true});
  }

 private:
  void probe() {
    const double t = system_->t(), h = system_->h();
    const double* x = system_->state().data();
    const std::size_t n = system_->state().size();
    Array whole(n), half(n), halves(n);
    if (!map_) map_.emplace(system_->ode(), system_->method().make());
    if (!map_->step(t, h, x, whole.data()) || !map_->step(t, h / 2, x, half.data()) ||
        !map_->step(t + h / 2, h / 2, half.data(), halves.data()))
      return;
    double most = 0;
    const StatePart& part = system_->shape().first();
    for (std::size_t i = 0; i < part.count; ++i)
      for (std::size_t c = 0; c < part.components.size(); ++c)
        most = std::max(most, std::abs(whole[part.at(i, c)] - halves[part.at(i, c)]));
    const double error = most / (1 - std::ldexp(1.0, -system_->integrator_info().order));
    if (!(error <= error_)) error_ = error;
  }

  Simulation* system_;
  double size_;  // m
  Spread probes_;
  std::optional<StepMap> map_;
  double error_ = std::nan("");
};

}  // namespace

std::unique_ptr<Criterion> watch_limit(const Watched& run) {
  return std::make_unique<LimitCriterion>(run);
}

std::unique_ptr<Criterion> watch_single_steps(const Watched& run) {
  const Simulation& system = run.system;
  if (!run.registry || system.integrator_info().adaptive) return nullptr;
  for (const auto& correction : system.corrections())
    if (correction->stands_for_forces()) return nullptr;
  int times = static_cast<int>(
      std::clamp(static_cast<double>(run.steps) / kStepsPerProbe, 0.0, double(kMostProbes)));
  // If no step is unstable, or the limit is not known, only step doubling shows a step that is too
  // long.
  if (system.integrator_info().implicit || std::isnan(system.integrator().amplification(0.1, 0)))
    times = std::max(times, 3);
  if (times == 0) return nullptr;
  return std::make_unique<SingleStepCriterion>(run, times);
}

}  // namespace sim::study
