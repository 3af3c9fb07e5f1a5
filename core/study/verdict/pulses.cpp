// A pulse can be so short that no stage of a step sees it.
#include "core/study/verdict/pulses.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/array.h"
#include "core/base/noise.h"
#include "core/math/median.h"
#include "core/particles/particle_system.h"
#include "core/study/accuracy/error_estimator.h"
#include "core/study/verdict/step_doubling.h"

namespace sim::study {

// An excess of the right-hand side between two frames.
struct StepDoubling::Pulse {
  std::size_t frame, number;     // the one before; among the driven ones
  double at;                     // s
  std::vector<double> impulses;  // its integral, beside what may be the usual value
  std::ptrdiff_t samples;        // that show it
  double longest;                // s, for which there is some of it without a break
  double lasting;                // s, of a velocity until the end; 1 of another number
  double moved;                  // by the largest until the end, m, or a number, if no step saw it
};

namespace {

constexpr int kFine = 1000;    // samples and steps between two frames
constexpr double kFoot = 0.1;  // of its peak: what belongs to a pulse, too
constexpr double kFar = 3;     // of the usual size of f: a value that belongs to a pulse

// The largest of those numbers, or their largest distance from others.
double largest_of(const std::vector<std::size_t>& numbers, const Array& values,
                  const Array* other = nullptr) {
  double most = 0;
  for (const std::size_t i : numbers)
    most = std::max(most, std::abs(values[i] - (other ? (*other)[i] : 0)));
  return most;
}

// The evaluations of f at which looking for pulses is cheap beside any study.
constexpr double kMostCheap = 20'000;
double cheap_evaluations(int particles) {
  constexpr double kOfOneParticle = 3e5;
  return kOfOneParticle / std::max(1, particles);
}

}  // namespace

bool may_have_pulses(Simulation& run) {
  const ParticleSystem* particles = particles_of(run);
  return !particles || std::ranges::any_of(particles->other_forces(), [](const Force* force) {
    return !force->conservative() && !force->has_dissipative_part() && !force->springs();
  });
}

std::vector<std::size_t> driven_numbers(const Simulation& run) {
  std::vector<std::size_t> numbers;
  const StateShape& shape = run.shape();
  const StatePart& part = run.second_order() ? *shape.find("velocity") : shape.first();
  for (std::size_t i = 0; i < part.count; ++i)
    for (std::size_t c = 0; c < part.components.size(); ++c) numbers.push_back(part.at(i, c));
  return numbers;
}

double shortest_pulse(Simulation& run, double time) {
  if (!may_have_pulses(run)) return HUGE_VAL;
  constexpr double kFewest = 100;
  constexpr int kMostResolved = 20;  // pulses
  const int samples =
      static_cast<int>(std::clamp(cheap_evaluations(run.particles()), kFewest, kMostCheap));
  OdeSystem& system = run.ode();
  const std::vector<std::size_t> numbers = driven_numbers(run);
  Array y(system.size()), rate(system.size()), usual_rate(system.size());
  const double* x = run.state().data();
  const auto rate_at = [&](double t, Array& out) {
    system.eval(t, {x, {}}, y.data(), out.data());
    return largest_of(numbers, out);
  };
  const double start = run.t(), spacing = time / samples;
  Noise noise;
  std::vector<double> times, sizes;
  for (int i = 0; i < samples; ++i) {
    times.push_back(start + spacing * (i + noise.next() + 0.5));
    sizes.push_back(rate_at(times.back(), rate));
  }
  const double usual = median(sizes);
  const auto quiet = std::ranges::find_if(sizes, [&](double size) { return size <= kFar * usual; });
  if (quiet == sizes.end()) return HUGE_VAL;
  const double quiet_size =
      rate_at(times[static_cast<std::size_t>(quiet - sizes.begin())], usual_rate);
  const auto in_pulse = [&](double t) {
    rate_at(t, rate);
    return largest_of(numbers, rate, &usual_rate) > kFar * usual;
  };
  const auto sample_in_pulse = [&](std::size_t i) {
    return sizes[i] + quiet_size > kFar * usual && in_pulse(times[i]);
  };
  double shortest = HUGE_VAL;
  int resolved = 0;
  for (std::size_t i = 0; i < times.size() && resolved < kMostResolved; ++i) {
    if (!sample_in_pulse(i)) continue;
    const std::size_t first = i;
    while (i + 1 < times.size() && sample_in_pulse(i + 1)) ++i;
    if (times[i] - times[first] >= std::min(shortest, kFar * spacing * kFine)) continue;
    ++resolved;
    // Its ends lie up to two spacings away.
    const double low = times[first] - 2 * spacing, width = times[i] - times[first] + 4 * spacing;
    int inside = 0;
    for (int k = 0; k < kFine; ++k) inside += in_pulse(low + width * (k + 0.5) / kFine) ? 1 : 0;
    shortest = std::min(shortest, width * std::max(1, inside) / kFine);
  }
  return shortest;
}

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
  if ((!may_jump_ && !given_motion_) || frames_.size() < 2) return;
  RefinedRun fresh = make_refined_run(plan(double(frames_.back().at.step - start_.step)));
  look_for_pulses(fresh.system(), allowed, result);
}

// The number of evaluations that cost about as much as the run.
double StepDoubling::affordable() const {
  if (!run_->second_order()) return kMostCheap;
  return std::min(kMostCheap,
                  std::max(cheap_evaluations(run_->particles()), double(evaluations_of(*run_))));
}

// Samples the right-hand side at many times between two states, at the first of them, and
// integrates it where a sample is far from all values at the states.
std::vector<StepDoubling::Pulse> StepDoubling::find_pulses(OdeSystem& system) const {
  constexpr int kFewest = 4;  // samples between two frames
  const std::size_t n = system.size();
  const std::vector<std::size_t> numbers = driven_numbers(*run_);
  Array y(n), rate(n), here(n);
  const auto rate_at = [&](double t, const Frame& frame, Array& out) {
    system.eval(t, {frame.seen.state.data(), {}}, y.data(), out.data());
  };
  std::vector<double> sizes;
  for (const Frame& frame : frames_) {
    rate_at(frame.at.t, frame, rate);
    sizes.push_back(largest_of(numbers, rate));
  }
  const double usual = median(sizes);
  const int probes = std::max(kFewest, static_cast<int>(affordable() / double(frames_.size())));
  std::vector<Pulse> pulses;
  Noise noise;
  for (std::size_t k = 0; k + 1 < frames_.size(); ++k) {
    const Frame &from = frames_[k], &to = frames_[k + 1];
    const double span = to.at.t - from.at.t;
    rate_at(from.at.t, from, here);
    double worst = kFar * usual, at = std::nan("");
    for (int i = 0; i < probes; ++i) {
      const double t = from.at.t + span * (i + noise.next() + 0.5) / probes;
      rate_at(t, from, rate);
      const double off = largest_of(numbers, rate, &here);
      if (!(off > worst)) continue;
      worst = off;
      at = t;
    }
    if (std::isnan(at)) continue;
    // For the number that is furthest off, the excess over its usual values at the two states.
    rate_at(at, from, rate);
    const auto furthest = std::ranges::max_element(
        numbers, {}, [&](std::size_t i) { return std::abs(rate[i] - here[i]); });
    const std::size_t c = *furthest;
    const double peak = rate[c];
    std::vector<double> values;
    for (int i = 0; i < kFine; ++i) {
      rate_at(from.at.t + span * (i + noise.next() + 0.5) / kFine, from, rate);
      values.push_back(rate[c]);
    }
    // A pulse may go on in the step behind the frame.
    std::vector<double> longer = values;
    for (int i = 1; i <= kFine && span * i / kFine < run_->h(); ++i) {
      rate_at(to.at.t + span * i / kFine, from, rate);
      longer.push_back(rate[c]);
    }
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / kFine;
    const double middle = median(values);
    // A missing velocity becomes a displacement by the end.
    const double lasting = run_->second_order() ? frames_.back().at.t - to.at.t + span : 1;
    // A long pulse may be the median there, a short one may act at the first state. Where it does
    // both, steps have seen it.
    Pulse pulse{k, static_cast<std::size_t>(furthest - numbers.begin()), at, {}, 0, 0, lasting, 0};
    for (const double usual_here : {here[c], middle}) {
      if (std::abs(usual_here) > kFar * usual) continue;
      pulse.impulses.push_back(span * (mean - usual_here));
      pulse.moved = std::max(pulse.moved, std::abs(pulse.impulses.back()) * lasting);
      const auto far = [&](double value) { return std::abs(value - usual_here); };
      pulse.samples =
          std::ranges::count_if(values, [&](double value) { return far(value) > kFar * usual; });
      int row = 0, most = 0;
      for (const double value : longer)
        most = std::max(most, row = far(value) > kFoot * far(peak) ? row + 1 : 0);
      pulse.longest = std::max(pulse.longest, span * most / kFine);
    }
    pulses.push_back(std::move(pulse));
  }
  return pulses;
}

// Fine steps show what the next state lacks of a pulse. Pulses are tried from the largest on; the
// known error covers the smallest. A velocity that is lacking moves a particle until the end; that
// of pulses which were missed is added to the error, or they are named if it is too large.
void StepDoubling::look_for_pulses(Simulation& shadow, double allowed, RunDeviation& result) const {
  if (given_motion_) look_for_leaps(shadow, allowed, result);
  if (!may_jump_ || !std::isnan(result.missed_at)) return;
  constexpr double kMissed = 0.5;     // of a pulse
  constexpr std::size_t kFewest = 4;  // pulses
  // A fine step at either end of a pulse may take it for a step shorter or longer.
  constexpr std::ptrdiff_t kEnough = 20, kEnds = 2;
  const std::size_t width = run_->flat() ? 1 : 3;
  const std::vector<std::size_t> numbers = driven_numbers(*run_);
  std::vector<Pulse> pulses = find_pulses(shadow.ode());
  std::ranges::stable_sort(pulses, std::greater(), &Pulse::moved);
  const auto most = std::max(kFewest, static_cast<std::size_t>(2 * affordable() / kFine));
  double moved = 0;
  std::size_t tried = 0;
  for (const Pulse& pulse : pulses) {
    const Frame& to = frames_[pulse.frame + 1];
    const double wrong = std::min(allowed, RunDeviation::kWrong * size_at(to));
    if (!(pulse.moved > std::min(wrong, result.error))) continue;
    if (!(pulse.moved > wrong) && tried >= most) continue;
    ++tried;
    const std::optional<std::vector<double>> fine = resolved(pulse.frame, kFine);
    if (!fine) continue;
    const auto lacking = [&](std::size_t k) {
      return (*fine)[numbers[k]] - to.seen.state[numbers[k]];
    };
    const double own = lacking(pulse.number);
    // Equal steps do not go past what lasts as long as they do.
    const bool seen = !run_->integrator_info().adaptive && pulse.longest >= run_->h();
    const bool missed = !seen && std::ranges::any_of(pulse.impulses, [&](double impulse) {
      return std::abs(own - impulse) < kMissed * std::abs(impulse);
    });
    double square = 0;
    const std::size_t first = pulse.number / width * width;
    for (std::size_t k = first; k < first + width; ++k) square += lacking(k) * lacking(k);
    const double whole = std::sqrt(square) * pulse.lasting;
    if (missed) {
      moved += std::max(pulse.moved, whole);
      if (moved > wrong) {
        result.missed_at = pulse.at;
        return;
      }
      continue;
    }
    const bool partly =
        pulse.samples >= kEnough &&
        std::abs(own) * double(pulse.samples) * pulse.lasting > double(kEnds) * pulse.moved;
    // A number may also differ by a vibration that both this run and the refined one damp.
    if (partly || run_->flat()) take_error(whole, to, result);
  }
  if (moved > 0) take_error(result.error + moved, frames_.back(), result);
}

}  // namespace sim::study
