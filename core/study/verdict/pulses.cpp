// Pulses: a force that depends on time alone can be so short that no stage of a step sees it.
#include <algorithm>
#include <numeric>

#include "core/base/array.h"
#include "core/base/noise.h"
#include "core/study/accuracy/error_estimator.h"
#include "core/study/verdict/step_doubling.h"

namespace sim::study {
namespace {

// The numbers of X whose rates of change are forces or right-hand sides.
std::vector<std::size_t> driven_numbers(const Simulation& run) {
  std::vector<std::size_t> numbers;
  const StateShape& shape = run.shape();
  const StatePart& part = run.second_order() ? *shape.find("velocity") : shape.first();
  for (std::size_t i = 0; i < part.count; ++i)
    for (std::size_t c = 0; c < part.components.size(); ++c) numbers.push_back(part.at(i, c));
  return numbers;
}

}  // namespace

// Goes from one frame to the next in so many steps, whatever the method would choose; empty if one
// fails.
std::optional<std::vector<double>> StepDoubling::resolved(std::size_t frame, int steps) const {
  const Frame &from = frames_[frame], &to = frames_[frame + 1];
  const Settings& own = run_->settings();
  MethodChoice choice = sharper(own.method);
  const Problem problem{spec_, registry_, {.integrator = own.method.choice(), .dt = own.h}};
  const auto has_equal = [](const Param& param) { return param.name == "fixed_step"; };
  if (std::ranges::any_of(own.method.plugin().params, has_equal)) {
    choice.given["fixed_step"] = true;
  } else if (run_->integrator_info().adaptive) {
    int order = 0;
    for (const Candidate& each : fitting_methods(problem, {}))
      if (!each.info.adaptive && !each.info.implicit && !each.chooses && each.info.order > order) {
        choice = each;
        order = each.info.order;
      }
  }
  Simulation fine = run_with_method(*spec_, *registry_, own, choice, (to.at.t - from.at.t) / steps,
                                    from.at.t, from.seen.state);
  for (int left = steps; left > 0;) {
    const int taken = fine.steps(left);
    if (taken == 0) return {};
    left -= taken;
  }
  return std::vector(fine.state().begin(), fine.state().end());
}

void StepDoubling::look_for_pulses(RunDeviation& result, double allowed) const {
  if (!may_jump_ || frames_.size() < 2) return;
  RefinedRun fresh = make_refined_run(plan(double(frames_.back().at.step - start_.step)));
  look_for_pulses(fresh.system(), allowed, result);
}

// Samples the right-hand side at many times between two states, at the first of them. If a sample
// is far from all values at the states, fine steps show whether the next state lacks its integral.
void StepDoubling::look_for_pulses(Simulation& shadow, double allowed, RunDeviation& result) const {
  if (!may_jump_) return;
  constexpr double kMostProbes = 20'000, kWork = 3e5;  // evaluations; of one particle
  constexpr int kFewest = 4, kFine = 1000;             // of an interval
  constexpr double kFar = 3, kSame = 0.5;
  OdeSystem& system = shadow.ode();
  const std::size_t n = system.size();
  const std::vector<std::size_t> numbers = driven_numbers(*run_);
  Array y(n), rate(n), here(n);
  const auto rate_at = [&](double t, const Frame& frame, Array& out) {
    system.eval(t, {frame.seen.state.data(), {}}, y.data(), out.data());
  };
  const auto largest = [&](const Array& values, const Array* other) {
    double most = 0;
    for (const std::size_t i : numbers)
      most = std::max(most, std::abs(values[i] - (other ? (*other)[i] : 0)));
    return most;
  };
  std::vector<double> sizes;
  for (const Frame& frame : frames_) {
    rate_at(frame.at.t, frame, rate);
    sizes.push_back(largest(rate, nullptr));
  }
  std::ranges::nth_element(sizes, sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2));
  const double usual = sizes[sizes.size() / 2];
  // The number of samples that cost about as much as the run.
  const double afforded =
      run_->second_order() ? std::min(kMostProbes, std::max(kWork / std::max(1, run_->particles()),
                                                            double(evaluations_of(*run_))))
                           : kMostProbes;
  const int probes = std::max(kFewest, static_cast<int>(afforded / double(frames_.size())));
  Noise noise;
  for (std::size_t k = 0; k + 1 < frames_.size(); ++k) {
    const Frame &from = frames_[k], &to = frames_[k + 1];
    const double span = to.at.t - from.at.t;
    rate_at(from.at.t, from, here);
    double worst = kFar * usual, at = std::nan("");
    for (int i = 0; i < probes; ++i) {
      const double t = from.at.t + span * (i + noise.next() + 0.5) / probes;
      rate_at(t, from, rate);
      if (largest(rate, &here) > worst) {
        worst = largest(rate, &here);
        at = t;
      }
    }
    if (std::isnan(at)) continue;
    // For the number that is furthest off, the excess over its usual values at the two states.
    rate_at(at, from, rate);
    const std::size_t c = *std::ranges::max_element(
        numbers, {}, [&](std::size_t i) { return std::abs(rate[i] - here[i]); });
    std::vector<double> values;
    for (int i = 0; i < kFine; ++i) {
      rate_at(from.at.t + span * (i + noise.next() + 0.5) / kFine, from, rate);
      values.push_back(rate[c]);
    }
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / kFine;
    std::ranges::nth_element(values, values.begin() + kFine / 2);
    // A missing velocity becomes a displacement by the end.
    const double lasting = run_->second_order() ? frames_.back().at.t - to.at.t + span : 1;
    // A long pulse may be the median there, a short one may act at the first state. Where it does
    // both, steps have seen it.
    std::optional<std::vector<double>> fine;
    for (const double usual_here : {here[c], values[kFine / 2]}) {
      if (std::abs(usual_here) > kFar * usual) continue;
      const double impulse = span * (mean - usual_here);
      const double wrong = std::min(allowed, RunDeviation::kWrong * size_at(to));
      if (!(std::abs(impulse) * lasting > wrong)) continue;
      if (!fine) fine = resolved(k, kFine);
      if (!fine) break;
      const double missing = (*fine)[c] - to.seen.state[c];
      if (std::abs(missing - impulse) < kSame * std::abs(impulse)) {
        result.missed_at = at;
        return;
      }
      // Not a pulse, but an error that the refined run may share: a vibration that both damp.
      if (run_->flat()) take_error(std::abs(missing), to, result);
    }
  }
}

}  // namespace sim::study
