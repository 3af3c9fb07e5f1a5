// Embedded pairs against a plain loop: steps, errors, dense output and what is kept of them.
#include "core/ode/explicit/embedded_rk.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/ode/driven_system.h"

using namespace sim;
using sim_test::DrivenSystem;

namespace {

using Numbers = std::vector<double>;

// Bogacki & Shampine's, whose estimate needs the slope at the end.
constexpr EmbeddedPair<3> kWithLast{
    .method = {.a = {{{}, {0.5}, {0, 0.75}}},
               .b = {2.0 / 9, 1.0 / 3, 4.0 / 9},
               .c = {0, 0.5, 0.75}},
    .error = {2.0 / 9 - 7.0 / 24, 1.0 / 3 - 0.25, 4.0 / 9 - 1.0 / 3, -0.125}};

// Heun's method with an estimate of its own, a second one, and two rows of dense output.
constexpr EmbeddedPair<2, 1, 2> kWithCoarse{
    .method = {.a = {{{}, {1}}}, .b = {0.5, 0.5}, .c = {0, 1}},
    .error = {0.3, -0.3, 0},
    .coarse = {0.2, 0.5, 0},
    .extra_a = {{{0.2, 0.1, 0.15, 0}}},
    .extra_c = {0.45},
    .dense = {{{0.4, -0.3, 0.2, -0.3}, {0.1, 0.6, -0.5, -0.2}}}};

// The method in plain loops, from the equations that the headers name.
class PlainPair {
 public:
  PlainPair(const EmbeddedPlan& plan, int order, const Tolerance& tolerance,
            const DrivenSystem& system)
      : plan_(plan), order_(order), tolerance_(tolerance), system_(&system) {}

  void begin(double at, const Numbers& from) {
    t = at, h = 0, x = end = from;
    k.assign(plan_.c.size(), {});
    k[0] = f(t, x);
    h_next = starting_step();
    evaluations += 2;
  }

  Numbers state_at(double until) {
    while (t + h < until) take_step();
    const double theta = (until - t) / h, rest = 1 - theta;
    if (theta >= 1) return end;
    const auto stages = static_cast<std::size_t>(plan_.stages);
    if (!extra_) {
      for (std::size_t i = stages + 1; i < k.size(); ++i) k[i] = stage(i, plan_.a[i]);
      evaluations += static_cast<int>(k.size() - stages - 1);
    }
    extra_ = true;
    Numbers out(x.size());
    for (std::size_t n = 0; n < x.size(); ++n) {
      // The cubic through both ends and their slopes, and what vanishes there with its slope.
      const double rise = end[n] - x[n];
      out[n] = x[n] + theta * rise +
               theta * rest * (rest * (h * k[0][n] - rise) - theta * (h * k[stages][n] - rise));
      for (std::size_t row = 0; row < plan_.dense.size(); ++row) {
        double factor = 1;  // theta (1-theta) theta (1-theta) .. of so many factors
        for (std::size_t j = 0; j < row; ++j) factor *= j % 2 == 0 ? theta : rest;
        for (std::size_t i = 0; i < k.size(); ++i)
          out[n] += h * theta * theta * rest * rest * factor * plan_.dense[row][i] * k[i][n];
      }
    }
    return out;
  }

  double t = 0, h = 0, h_next = 0, error_before = 1;
  bool repeated = false;
  std::int64_t steps = 0, rejected = 0, evaluations = 0;
  Numbers x, end;
  std::vector<Numbers> k;

 private:
  Numbers f(double at, const Numbers& y) const {
    Numbers slope(y.size());
    for (std::size_t i = 0; i < y.size(); ++i) slope[i] = system_->slope(at, y[i], i);
    return slope;
  }
  Numbers point(const Numbers& weights) const {
    Numbers y = x;
    for (std::size_t n = 0; n < y.size(); ++n)
      for (std::size_t i = 0; i < weights.size(); ++i)
        if (weights[i] != 0) y[n] += h * weights[i] * k[i][n];
    return y;
  }
  Numbers stage(std::size_t i, const Numbers& weights) const {
    return f(t + plan_.c[i] * h, point(weights));
  }
  double norm(const Numbers& values, const Numbers& a, const Numbers& b) const {
    double most = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      most = std::max(most, std::fabs(values[i]) /
                                (tolerance_.atol +
                                 tolerance_.rtol * std::max(std::fabs(a[i]), std::fabs(b[i]))));
    return most;
  }
  double starting_step() const {
    const double size = norm(x, x, x), slope = norm(k[0], x, x);
    const double first = size < 1e-5 || slope < 1e-5 ? 1e-6 : 0.01 * size / slope;
    Numbers y = x;
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += first * k[0][i];
    Numbers change = f(t + first, y);
    for (std::size_t i = 0; i < y.size(); ++i) change[i] -= k[0][i];
    const double most = std::max(slope, norm(change, x, x) / first);
    return std::min(100 * first, most <= 1e-15 ? std::max(1e-6, 1e-3 * first)
                                               : std::pow(0.01 / most, 1.0 / (order_ + 1)));
  }
  double weighted_norm(const Numbers& weights) const {
    Numbers sum(x.size(), 0);
    for (std::size_t n = 0; n < x.size(); ++n)
      for (std::size_t i = 0; i < weights.size(); ++i)
        if (weights[i] != 0) sum[n] += h * weights[i] * k[i][n];
    return norm(sum, x, end);
  }
  void take_step() {
    const auto stages = static_cast<std::size_t>(plan_.stages);
    const bool needs_last = plan_.error.back() != 0;
    t += h;
    if (h > 0) k[0] = k[stages];
    x = end;
    extra_ = false;
    for (;;) {
      h = std::min(h_next, tolerance_.max_step);
      for (std::size_t i = 1; i < stages; ++i) k[i] = stage(i, plan_.a[i]);
      evaluations += plan_.stages - 1;
      end = point(plan_.method.b);
      if (needs_last) k[stages] = f(t + h, end), ++evaluations;
      double error = weighted_norm(plan_.error);
      if (!plan_.coarse.empty()) {
        const double coarse = weighted_norm(plan_.coarse);
        error = error * error / std::sqrt(error * error + 0.01 * coarse * coarse);
      }
      const double k_order = order_;
      if (error > 1) {
        h_next = h * std::max(0.2, 0.9 * std::pow(error, -1 / k_order));
        repeated = true;
        ++rejected;
        continue;
      }
      if (!needs_last) k[stages] = f(t + h, end), ++evaluations;
      const double factor =
          0.9 * std::pow(error, -0.7 / k_order) * std::pow(error_before, 0.4 / k_order);
      h_next = h * std::min(repeated ? 1.0 : 5.0, std::max(0.2, factor));
      error_before = std::max(error, 1e-4);
      repeated = false;
      ++steps;
      return;
    }
  }

  EmbeddedPlan plan_;
  int order_;
  Tolerance tolerance_;
  const DrivenSystem* system_;
  bool extra_ = false;
};

// The powers of the controller are quick ones: each step is right to 1e-8 of its size.
bool close(const double* a, const Numbers& b, double part = 1e-6) {
  for (std::size_t i = 0; i < b.size(); ++i)
    if (!(std::fabs(a[i] - b[i]) <= part * (1 + std::fabs(b[i])))) return false;
  return true;
}

// Nine numbers are more than the lanes of a norm.
const Numbers kRates{-1, -0.5, 0.25, -2, -0.1, 0.5, -1.5, -0.7, -3};
Array beginning() {
  Array x(kRates.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1.5 - 0.4 * static_cast<double>(i);
  return x;
}

void compare(const EmbeddedPlan& plan, int order, const Tolerance& tolerance, double size = 1) {
  DrivenSystem system(kRates);
  EmbeddedRungeKutta method(plan, order, tolerance);
  method.prepare(system);
  Array x = beginning(), x_next(x.size());
  for (double& number : x.span()) number *= size;
  PlainPair plain(plan, order, tolerance, system);
  plain.begin(0, {x.data(), x.data() + x.size()});
  constexpr double kInterval = 0.03;
  for (int n = 0; n < 60; ++n) {
    CAPTURE(n);
    REQUIRE(method.step(system, n * kInterval, kInterval, x.data(), x_next.data()) ==
            StepStatus::kDone);
    const Numbers expected = plain.state_at(n * kInterval + kInterval);
    REQUIRE(close(x_next.data(), expected));
    const Numbers memory = method.memory();
    REQUIRE(memory.size() == 5 + x.size());
    REQUIRE(close(memory.data(), {plain.t, plain.h, plain.h_next, plain.error_before,
                                  plain.repeated ? 1.0 : 0.0}));
    REQUIRE(close(memory.data() + 5, plain.x));
    const Effort effort = method.effort();
    REQUIRE(effort.steps == plain.steps);
    REQUIRE(effort.rejected == plain.rejected);
    REQUIRE(effort.evaluations == plain.evaluations);
    REQUIRE(effort.evaluations == system.evaluations);
    std::swap(x, x_next);
  }
  CHECK(plain.rejected > 0);
  CHECK(plain.steps > 20);
}

}  // namespace

TEST_CASE("steps of embedded pairs are those of a plain loop, rejected ones and all") {
  compare(EmbeddedPlan(kWithLast), 3, {.atol = 1e-6, .rtol = 1e-4});
  compare(EmbeddedPlan(kWithLast), 3, {.atol = 1e-3, .rtol = 1e-3, .max_step = 0.07});
  compare(EmbeddedPlan(kWithCoarse), 2, {.atol = 1e-4, .rtol = 1e-3});
  compare(EmbeddedPlan(kWithLast), 3, {.atol = 1e-3, .rtol = 1e-3}, 0);  // from nothing
}

TEST_CASE("what a pair keeps leads on with the same steps, and what does not fit begins anew") {
  const Tolerance tolerance{.atol = 1e-5, .rtol = 1e-5};
  constexpr double kInterval = 0.05;
  for (const EmbeddedPlan& plan : {EmbeddedPlan(kWithLast), EmbeddedPlan(kWithCoarse)}) {
    DrivenSystem system(kRates);
    EmbeddedRungeKutta method(plan, 3, tolerance);
    method.prepare(system);
    Array x = beginning(), x_next(x.size()), other(x.size());
    for (int n = 0; n < 25; ++n) {
      const Numbers kept = method.memory();
      Array from(x.size());
      std::copy_n(x.data(), x.size(), from.data());
      REQUIRE(method.step(system, n * kInterval, kInterval, x.data(), x_next.data()) ==
              StepStatus::kDone);
      const auto with = [&](const Numbers& memory, double t) {
        EmbeddedRungeKutta second(plan, 3, tolerance);
        second.prepare(system);
        second.recall(memory);
        REQUIRE(second.step(system, t, kInterval, from.data(), other.data()) == StepStatus::kDone);
        return Numbers(other.data(), other.data() + other.size());
      };
      const double t = n * kInterval;
      const Numbers anew = with({}, t), next(x_next.data(), x_next.data() + x.size());
      CHECK(with(kept, t) == next);
      if (n == 20) {
        CHECK(anew != next);
        Numbers longer = kept, shorter = kept;
        longer.push_back(0);
        shorter.pop_back();
        CHECK(with(longer, t) == anew);
        CHECK(with(shorter, t) == anew);
        for (const std::size_t place : {1, 2, 3})
          for (const double bad : {0.0, -1.0}) {
            Numbers wrong = kept;
            wrong[place] = bad;
            CHECK(with(wrong, t) == anew);
          }
        // Kept of another time: a step that ended before, or that begins later.
        const double early = kept[0] - 1e-3;
        CHECK(with(kept, early) == with({}, early));
        const double late = kept[0] + kept[1] + 0.011 * (kInterval + kept[1]);
        CHECK(with(kept, late) == with({}, late));
        const double still = kept[0] + kept[1] + 0.009 * (kInterval + kept[1]);
        CHECK(with(kept, still) != with({}, still));
      }
      std::swap(x, x_next);
    }
  }
}

TEST_CASE("a pair that cannot keep its tolerance says so with the numbers it has") {
  DrivenSystem system(kRates);
  Array x = beginning(), x_next(x.size());
  EmbeddedRungeKutta strict(EmbeddedPlan(kWithLast), 3, {.atol = 1e-200, .rtol = 0});
  strict.prepare(system);
  CHECK(strict.step(system, 1, 0.1, x.data(), x_next.data()) == StepStatus::kStepTooSmall);
  CHECK(strict.effort().steps == 0);

  // f ends on the way: what is shown are numbers that are not finite.
  for (const EmbeddedPlan& plan : {EmbeddedPlan(kWithLast), EmbeddedPlan(kWithCoarse)}) {
    EmbeddedRungeKutta method(plan, 3, {.atol = 1e-3, .rtol = 1e-3});
    system.ends = 0.55;
    method.prepare(system);
    CHECK(method.step(system, 0.5, 0.04, x.data(), x_next.data()) == StepStatus::kDone);
    CHECK(method.step(system, 0.54, 0.04, x.data(), x_next.data()) != StepStatus::kDone);
    EmbeddedRungeKutta late(plan, 3, {.atol = 1e-3, .rtol = 1e-3});
    late.prepare(system);
    CHECK(late.step(system, 0.6, 0.04, x.data(), x_next.data()) == StepStatus::kNotFinite);
    CHECK(std::isnan(x_next[0]));
    CHECK(late.effort().evaluations == 1);
  }
}
