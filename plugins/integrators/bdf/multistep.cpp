#include "multistep.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/base/slot.h"
#include "core/math/elementary.h"

namespace sim {
namespace {

constexpr double kFirstGrowth = 1e4, kGrowth = 10;

}  // namespace

void Bdf::prepare(OdeSystem& system) {
  if (system.events() || system.has_inequalities())
    throw Error(ErrorKind::kScene,
                {"integrator does not fit", "",
                 "bdf goes on from several states before, and contact or constraints make those of "
                 "this scene jump",
                 "use esdirk43"});
  solver_ = system.stage_solver(options_);
  for (Array& array : z_) array = Array(system.size());
  for (Array& array : predicted_) array = Array(system.size());
  for (Array* array : {&saved_, &y_, &r_, &change_, &weights_}) *array = Array(system.size());
  own_ = {};
  fresh_ = true;
}

// A first step of order 1 that changes the state by half of the tolerance.
void Bdf::begin(OdeSystem& system, double t, double h, const double* x) {
  solver_->restart();
  now_ = {.t = t};
  now_.growth = kFirstGrowth;
  std::copy_n(x, y_.size(), z_[0].data());
  system.eval(t, {x, {}}, y_.data(), z_[1].data());
  ++own_.evaluations;
  set_weights();
  const double slope = norm(z_[1]);
  now_.h = std::min(slope > 0 ? 0.5 / slope : h, tolerance_.max_step);
  now_.next_h = now_.h;
  for (double& number : z_[1].span()) number *= now_.h;
}

void Bdf::set_weights() {
  for (std::size_t i = 0; i < weights_.size(); ++i)
    weights_[i] = 1 / (tolerance_.atol + tolerance_.rtol * std::fabs(z_[0][i]));
}

double Bdf::norm(const Array& values) const {
  double most = 0, poison = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double ratio = std::fabs(values[i]) * weights_[i];
    most = ratio > most ? ratio : most;
    poison += 0 * ratio;
  }
  return most + poison;
}

// With xi_j = (t - t_(n-j)) / h the polynomial through the correction is
//   l(x) = (1 + x/xi*_q) prod_{j<q} (1 + x/xi_j),
// its leading coefficient that of equal steps, sum_{j<=q} 1/j = l_1. The error of order q is
// e error_, of q - 1 z_q lower_, and of q + 1 (e - quotient saved_) higher_.
void Bdf::set_coefficients(double h) {
  const int q = now_.order;
  l_ = {1, 1};
  double alpha = -1, alpha_hat = -1, xi_inverse = 1, last_inverse = 1, sum = h;
  const auto multiply = [&](double inverse, int degree) {
    for (int i = degree; i >= 1; --i) l_[slot(i)] += l_[slot(i - 1)] * inverse;
  };
  if (q > 1) {
    for (int j = 2; j < q; ++j) {
      sum += now_.past[slot(j - 2)];
      xi_inverse = h / sum;
      alpha -= 1.0 / j;
      multiply(xi_inverse, j);
    }
    alpha -= 1.0 / q;
    last_inverse = -l_[1] - alpha;
    sum += now_.past[slot(q - 2)];
    xi_inverse = h / sum;
    alpha_hat = -l_[1] - xi_inverse;
    multiply(last_inverse, q);
  }
  const double a = 1 - alpha_hat + alpha, b = 1 + q * a;
  error_ = std::fabs(a / (alpha * b));
  scale_ = std::fabs(b * last_inverse / (l_[slot(q)] * xi_inverse));
  lower_ = 1;
  if (q > 1) {
    const double c = last_inverse / l_[slot(q)], d = alpha + 1.0 / q, e = alpha_hat + xi_inverse;
    lower_ = std::fabs(c * (1 - e + d) / d);
  }
  sum += now_.past[slot(q - 1)];
  xi_inverse = h / sum;
  const double f = alpha - 1.0 / (q + 1), g = alpha_hat - xi_inverse;
  higher_ = std::fabs((1 - g + f) / b / (xi_inverse * (q + 2) * f));
  tau_ = h / l_[1];
}

// One order more: the derivative estimated by the last correction becomes z_(q+1), with the
// polynomial x^2 prod_{j<q} (x + xi_j), which changes no value of the history. One less: z_q is
// removed, with such a polynomial of its degree.
void Bdf::change_order(int order) {
  const int q = now_.order;
  if (order == q) return;
  Coefficients l{};
  l[2] = 1;
  double sum = 0;
  const auto multiply = [&](double xi, int degree) {
    for (int i = degree; i >= 2; --i) l[slot(i)] = l[slot(i)] * xi + l[slot(i - 1)];
  };
  if (order > q) {
    double alpha = -1, inverse = 1, product = 1, xi_before = 1;
    sum = now_.h;
    for (int j = 1; j < q; ++j) {
      sum += now_.past[slot(j)];
      const double xi = sum / now_.h;
      product *= xi;
      alpha -= 1.0 / (j + 1);
      inverse += 1 / xi;
      multiply(xi_before, j + 2);
      xi_before = xi;
    }
    const double scale = (-alpha - inverse) / product;
    Array& last = z_[slot(q + 1)];
    for (std::size_t i = 0; i < last.size(); ++i) last[i] = scale * saved_[i];
    for (int j = 2; j <= q; ++j)
      for (std::size_t i = 0; i < last.size(); ++i) z_[slot(j)][i] += l[slot(j)] * last[i];
  } else if (q > 2) {
    for (int j = 1; j <= q - 2; ++j) {
      sum += now_.past[slot(j - 1)];
      multiply(sum / now_.h, j + 2);
    }
    const Array& last = z_[slot(q)];
    for (int j = 2; j < q; ++j)
      for (std::size_t i = 0; i < last.size(); ++i) z_[slot(j)][i] -= l[slot(j)] * last[i];
  }
  now_.order = order;
  now_.wait = order + 1;
}

// predicted_j = sum_{k>=j} (k over j) z_k
void Bdf::predict() {
  const int q = now_.order;
  for (int j = 0; j <= q; ++j)
    std::copy_n(z_[slot(j)].data(), y_.size(), predicted_[slot(j)].data());
  for (int k = 1; k <= q; ++k)
    for (int j = q; j >= k; --j) {
      double* const to = predicted_[slot(j - 1)].data();
      const double* const from = predicted_[slot(j)].data();
      for (std::size_t i = 0; i < y_.size(); ++i) to[i] += from[i];
    }
}

void Bdf::correct() {
  for (int j = 0; j <= now_.order; ++j) {
    double* const to = z_[slot(j)].data();
    const double* const from = predicted_[slot(j)].data();
    const double weight = l_[slot(j)];
    for (std::size_t i = 0; i < y_.size(); ++i) to[i] = from[i] + weight * change_[i];
  }
}

// The step after the present one, retried until its error is within the tolerance. If there is
// none, the present state stays as it is.
StepStatus Bdf::next_step(OdeSystem& system) {
  constexpr double kAfterNewton = 0.25, kLeast = 0.1, kMostAfter = 0.9, kSmallest = 1e-13;
  constexpr int kManyFailures = 3;
  const double first_h = now_.next_h;
  if (now_.next_order != now_.order) change_order(now_.next_order);
  const auto rescale = [&](double h) {
    const double ratio = h / now_.h;
    double factor = 1;
    for (int j = 1; j <= now_.order; ++j) {
      factor *= ratio;
      for (double& number : z_[slot(j)].span()) number *= factor;
    }
    now_.h = h;
  };
  int failures = 0;
  double h = first_h;
  for (;;) {
    if (system.stopped()) {
      now_.next_h = h;
      now_.next_order = now_.order;
      return StepStatus::kStopped;
    }
    if (h != now_.h) rescale(h);
    if (!(now_.t + 0.1 * h > now_.t) || h < kSmallest * first_h) {
      now_.next_h = h;
      now_.next_order = now_.order;
      return all_finite(y_.span()) ? StepStatus::kStepTooSmall : StepStatus::kNotFinite;
    }
    set_coefficients(h);
    predict();
    for (std::size_t i = 0; i < y_.size(); ++i) {
      y_[i] = predicted_[0][i];
      r_[i] = predicted_[0][i] - predicted_[1][i] / l_[1];
    }
    const StepStatus status = solver_->solve(now_.t + h, tau_, r_.data(), y_.data());
    if (status == StepStatus::kStopped) {
      now_.next_h = h;
      now_.next_order = now_.order;
      return status;
    }
    if (status != StepStatus::kDone) {
      ++own_.rejected;
      now_.growth = 1;
      h *= kAfterNewton;
      continue;
    }
    for (std::size_t i = 0; i < y_.size(); ++i) change_[i] = y_[i] - predicted_[0][i];
    const double error = error_ * norm(change_);
    if (!(error <= 1)) {
      ++own_.rejected;
      ++failures;
      now_.growth = 1;
      const double finite = std::min(error, 1e30);
      if (failures >= kManyFailures && now_.order > 1) {
        change_order(now_.order - 1);
        h *= kLeast;
      } else if (failures >= kManyFailures) {
        // The history does not predict the motion: the slope is evaluated again.
        h *= kLeast;
        rescale(h);
        system.eval(now_.t, {z_[0].data(), {}}, r_.data(), z_[1].data());
        ++own_.evaluations;
        for (double& number : z_[1].span()) number *= h;
        now_.wait = 10;
      } else {
        const double shrink =
            std::isnan(error) ? kLeast : power(6 * finite, -1.0 / (now_.order + 1));
        h *= std::clamp(shrink, kLeast, kMostAfter);
      }
      continue;
    }
    correct();
    now_.t += h;
    for (std::size_t i = now_.past.size() - 1; i > 0; --i) now_.past[i] = now_.past[i - 1];
    now_.past[0] = h;
    ++own_.steps;
    set_weights();
    choose_next(error);
    return StepStatus::kDone;
  }
}

// The order with the longest next step, after q + 1 steps of one order; a change has to pay.
void Bdf::choose_next(double error) {
  constexpr double kThreshold = 1.5, kBias = 6, kBiasHigher = 10, kAdd = 1e-6, kTiny = 1e-30;
  const int q = now_.order;
  const auto growth = [&](double bias, double of, int power_of) {
    const double root = of > kTiny ? power(bias * std::min(of, 1e30), 1.0 / power_of) : 0;
    return 1 / (root + kAdd);
  };
  double best = growth(kBias, error, q + 1);
  int order = q;
  --now_.wait;
  if (now_.wait == 0) {
    now_.wait = 2;
    if (q > 1)
      if (const double less = growth(kBias, lower_ * norm(z_[slot(q)]), q); less > best) {
        best = less;
        order = q - 1;
      }
    if (q < kMostOrder && now_.saved_scale > 0) {
      // The difference of two corrections, both of the derivative q + 1.
      double ratio = scale_ / now_.saved_scale;
      for (int j = 0; j <= q; ++j) ratio *= now_.h / now_.past[1];
      for (std::size_t i = 0; i < r_.size(); ++i) r_[i] = change_[i] - ratio * saved_[i];
      if (const double more = growth(kBiasHigher, higher_ * norm(r_), q + 2); more > best) {
        best = more;
        order = q + 1;
        std::copy_n(change_.data(), change_.size(), saved_.data());
      }
    }
  }
  const double most = now_.growth;
  now_.growth = kGrowth;
  now_.next_h = now_.h;
  now_.next_order = q;
  if (most == 1) now_.wait = std::max(now_.wait, 2);  // after a failure nothing grows
  if (std::min(best, most) < kThreshold) {
    if (order > q) now_.saved_scale = 0;
  } else {
    now_.next_order = order;
    now_.next_h = now_.h * std::min(best, most);
  }
  now_.next_h = std::min(now_.next_h, tolerance_.max_step);
  if (now_.wait == 1 && q < kMostOrder) {
    std::copy_n(change_.data(), change_.size(), saved_.data());
    now_.saved_scale = scale_;
  }
}

Advance Bdf::advance(OdeSystem& system, double t, double h, std::int64_t /*most*/, const double* x,
                     double* x_next) {
  const double length = now_.past[0];
  // A recalled history is used only if it contains this time.
  if (fresh_ || !(now_.t - length <= t + h && t <= now_.t + 0.01 * (h + length)))
    begin(system, t, h, x);
  fresh_ = false;
  while (now_.t < t + h)
    if (const StepStatus status = next_step(system); status != StepStatus::kDone) {
      const bool shown = status == StepStatus::kNotFinite;
      std::copy_n(shown ? y_.data() : x, y_.size(), x_next);
      return {status};
    }
  interpolate(t + h, x_next);
  if (!system.project(t + h, x_next)) return {StepStatus::kNotConverged};
  return {StepStatus::kDone, 1};
}

void Bdf::interpolate(double t, double* out) const {
  const double s = (t - now_.t) / now_.h;
  std::copy_n(z_[slot(now_.order)].data(), y_.size(), out);
  for (int j = now_.order - 1; j >= 0; --j)
    for (std::size_t i = 0; i < y_.size(); ++i) out[i] = out[i] * s + z_[slot(j)][i];
}

std::vector<double> Bdf::memory() const {
  if (fresh_) return {};
  std::vector<double> kept{now_.t,
                           now_.h,
                           now_.next_h,
                           static_cast<double>(now_.order),
                           static_cast<double>(now_.next_order),
                           static_cast<double>(now_.wait),
                           now_.growth,
                           now_.saved_scale};
  kept.insert(kept.end(), now_.past.begin(), now_.past.end());
  const auto add = [&](const Array& array) {
    kept.insert(kept.end(), array.span().begin(), array.span().end());
  };
  for (const Array& array : z_) add(array);
  add(saved_);
  const std::vector<double> of_solver = solver_->memory();
  kept.insert(kept.end(), of_solver.begin(), of_solver.end());
  return kept;
}

void Bdf::recall(std::span<const double> memory) {
  constexpr std::size_t kHead = 8;
  const std::size_t past = now_.past.size(), size = y_.size();
  fresh_ = true;
  if (memory.size() < kHead + past + (kArrays + 1) * size) return;
  const auto order_at = [&](std::size_t i) {
    const double order = memory[i];
    return order >= 1 && order <= kMostOrder ? static_cast<int>(order) : 0;
  };
  History kept{.t = memory[0], .h = memory[1], .next_h = memory[2]};
  kept.order = order_at(3);
  kept.next_order = order_at(4);
  const bool known = kept.order > 0 && kept.next_order > 0 &&
                     std::abs(kept.order - kept.next_order) <= 1 && memory[5] >= 0 &&
                     memory[5] < 100 && kept.h > 0 && kept.next_h > 0;
  if (!known || !all_finite(memory)) return;
  kept.wait = static_cast<int>(memory[5]);
  kept.growth = memory[6];
  kept.saved_scale = memory[7];
  std::ranges::copy(memory.subspan(kHead, past), kept.past.begin());
  now_ = kept;
  memory = memory.subspan(kHead + past);
  const auto take = [&](Array& array) {
    std::ranges::copy(memory.first(size), array.data());
    memory = memory.subspan(size);
  };
  for (Array& array : z_) take(array);
  take(saved_);
  set_weights();
  solver_->recall(memory);
  fresh_ = false;
}

Effort Bdf::effort() const { return (solver_ ? solver_->effort() : Effort{}) + own_; }

}  // namespace sim
