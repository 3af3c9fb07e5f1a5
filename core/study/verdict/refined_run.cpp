#include "core/study/verdict/refined_run.h"

#include <algorithm>

#include "core/particles/particle_system.h"
#include "core/study/accuracy/error_estimator.h"
#include "core/study/accuracy/trajectory.h"

namespace sim::study {

std::vector<double> positions(Simulation& system) {
  if (!system.second_order()) return state_of(system);
  const ParticleView p = particles_of(system)->view(system.t(), system.state().data());
  std::vector<double> values(static_cast<std::size_t>(3 * p.n));
  double* next = values.data();
  for (int i = 0; i < p.n; ++i)
    for (const double* axis : {p.x, p.y, p.z}) *next++ = axis[i];
  return values;
}

std::vector<double> state_of(const Simulation& system) {
  return {system.state().begin(), system.state().end()};
}

RefinedRun::RefinedRun(const SystemSpec& spec, Registry& registry, const Settings& own,
                       const Moment& begin, std::span<const double> x, Plan plan)
    : system_(run_with_method(spec, registry, own, plan.method ? *plan.method : sharper(own.method),
                              own.h / plan.steps_per_step, begin.t, x)),
      plan_(std::move(plan)),
      h_(own.h),
      now_(begin),
      courses_(plan_.figures.size()) {}

bool RefinedRun::run(double steps, const std::function<bool()>& stop) {
  for (auto left = static_cast<std::int64_t>(steps); left > 0;) {
    const int taken =
        stop() ? 0 : system_.steps(plan_.stride ? std::min(left, plan_.stride) : left);
    if (taken == 0) return false;
    left -= taken;
    if (plan_.stride) look();
  }
  return true;
}

// The last step of a run may be shorter than the others; its part of the refined run is then
// divided into as many steps.
bool RefinedRun::follow(const Moment& to, const std::function<bool()>& stop) {
  if (path_.empty()) look_at_figures();
  if (plan_.shifted) return follow_between(to, stop);
  const auto steps = static_cast<double>(to.step - now_.step);
  const bool cut = to.t < now_.t + (steps - 1e-6) * h_;
  if (!run(plan_.steps_per_step * (cut ? steps - 1 : steps), stop)) return false;
  if (cut) {
    system_.set_dt((to.t - system_.t()) / plan_.steps_per_step);
    if (!run(plan_.steps_per_step, stop)) return false;
  }
  now_ = to;
  record();
  return true;
}

bool RefinedRun::follow_between(const Moment& to, const std::function<bool()>& stop) {
  const double middle = now_.t + 0.5 * system_.h();
  if (path_.empty() && to.t > middle && !system_.step_to(middle)) return false;
  return look_between_steps(system_, to.t, [&] { return !stop(); }, [&] { record(); });
}

void RefinedRun::record() {
  path_.push_back({positions(system_), plan_.energy ? system_.energy().total() : std::nan(""),
                   plan_.states ? state_of(system_) : std::vector<double>(),
                   system_.settings().broken});
}

void RefinedRun::look_at_figures() {
  for (std::size_t i = 0; i < courses_.size(); ++i)
    courses_[i].look(system_.t(), plan_.figures[i].at(system_));
}

void RefinedRun::look() {
  look_at_figures();
  if (!plan_.springs) return;
  const Pinch near = nearest_pinch(system_, static_cast<double>(plan_.stride) * system_.h());
  shortest_ = std::min(shortest_, near.share);
  if (near.margin < pinch_.margin) {
    pinch_ = near;
    pinched_at_ = system_.t();
  }
  if (!plan_.strain) return;
  const StrainedSpring worst = worst_spring(system_);
  if (worst.a >= 0 && !(std::abs(worst.strain) <= std::abs(strain_.strain))) strain_ = worst;
}

std::vector<double> RefinedRun::figures() const {
  std::vector<double> figures;
  for (std::size_t i = 0; i < courses_.size(); ++i)
    figures.push_back(courses_[i].figure(plan_.figures[i]));
  return figures;
}

}  // namespace sim::study
