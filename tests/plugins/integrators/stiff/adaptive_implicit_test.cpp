// Implicit methods against plain loops, on systems whose stages have closed forms.
#include "plugins/integrators/stiff/adaptive_implicit.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/slot.h"
#include "tests/ode/driven_system.h"

using namespace sim;
using sim_test::DrivenSystem;

namespace {

using Numbers = std::vector<double>;

constexpr int kStages = 3;
constexpr ImplicitPair<kStages> kPair{.method = {.a = {{{}, {0.25, 0.25}, {0.3, 0.45, 0.25}}},
                                                 .b = {0.3, 0.45, 0.25},
                                                 .c = {0, 0.5, 1}},
                                      .embedded = {0.2, 0.5, 0.3}};
constexpr int kOrder = 2;

const Numbers kStiffRates{-300, -1, 0.5};

Array beginning() {
  Array x(kStiffRates.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1 - 0.8 * static_cast<double>(i);
  return x;
}

struct PlainImplicit {
  const DrivenSystem& system;
  Tolerance tolerance;
  int failures = 0;  // of equations, at the beginning
  double t = 0, h = 0, h_next = 0, error_before = 1;
  bool repeated = false;
  std::int64_t steps = 0, rejected = 0, solved = 0;
  Numbers x = {}, y = {}, slope = {}, last_slope = {};

  double norm(const Numbers& values, const Numbers& a, const Numbers& b) const {
    double most = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      most = std::max(
          most, std::fabs(values[i]) /
                    (tolerance.atol + tolerance.rtol * std::max(std::fabs(a[i]), std::fabs(b[i]))));
    return most;
  }
  void begin(double at, const Numbers& from) {
    t = at, h = 0, x = y = from;
    slope = last_slope = from;
    for (std::size_t i = 0; i < from.size(); ++i) last_slope[i] = system.slope(at, from[i], i);
    h_next = 0.5 / norm(last_slope, from, from);
  }
  void take_step() {
    t += h;
    x = y;
    slope = last_slope;
    for (;; ++rejected, repeated = true) {
      h = std::min(h_next, tolerance.max_step);
      if (failures > 0) {
        --failures;
        ++solved;
        h_next = 0.2 * h;
        continue;
      }
      Numbers error = x;
      for (std::size_t i = 0; i < x.size(); ++i) {
        double k[kStages] = {slope[i]};
        for (int s = 1; s < kStages; ++s) {
          double r = x[i];
          for (int j = 0; j < s; ++j) r += h * kPair.method.a[slot(s)][slot(j)] * k[j];
          y[i] = system.solution(t + kPair.method.c[slot(s)] * h, 0.25 * h, r, i);
          k[s] = (y[i] - r) / (0.25 * h);
        }
        last_slope[i] = k[kStages - 1];
        error[i] = 0;
        for (std::size_t s = 0; s < kStages; ++s)
          error[i] += h * (kPair.method.b[s] - kPair.embedded[s]) * k[s];
      }
      solved += kStages - 1;
      const double size = norm(error, x, y);
      if (size > 1) {
        h_next = h * std::max(0.2, 0.9 * std::pow(size, -1.0 / kOrder));
        continue;
      }
      const double factor =
          0.9 * std::pow(size, -0.7 / kOrder) * std::pow(error_before, 0.4 / kOrder);
      h_next = h * std::min(repeated ? 1.0 : 5.0, std::max(0.2, factor));
      error_before = std::max(size, 1e-4);
      repeated = false;
      ++steps;
      return;
    }
  }
  Numbers state_at(double until) {
    while (t + h < until) take_step();
    if (until >= t + h) return y;
    // Hermite's cubic in its four basis functions.
    const double s = (until - t) / h;
    Numbers out(x.size());
    for (std::size_t i = 0; i < x.size(); ++i)
      out[i] = (1 + 2 * s) * (1 - s) * (1 - s) * x[i] + s * (1 - s) * (1 - s) * h * slope[i] +
               s * s * (3 - 2 * s) * y[i] + s * s * (s - 1) * h * last_slope[i];
    return out;
  }
};

void require_close(const double* a, const Numbers& b, double part = 1e-6) {
  for (std::size_t i = 0; i < b.size(); ++i) {
    CAPTURE(i);
    REQUIRE(a[i] == Approx(b[i]).epsilon(part).margin(part));
  }
}

}  // namespace

TEST_CASE("adaptive implicit steps are those of a plain loop, rejected ones and all") {
  for (const Tolerance& tolerance :
       {Tolerance{.atol = 1e-4, .rtol = 1e-3}, {.atol = 1e-3, .rtol = 1e-3, .max_step = 0.04}})
    for (const int failures : {0, 2}) {
      DrivenSystem system(kStiffRates);
      AdaptiveImplicit method(kPair, kOrder, tolerance, {});
      method.prepare(system);
      Array x = beginning(), x_next(x.size()), other(x.size());
      PlainImplicit plain{.system = system, .tolerance = tolerance, .failures = failures};
      plain.begin(0, {x.data(), x.data() + x.size()});
      system.failures = failures;
      constexpr double kInterval = 0.03;
      for (int n = 0; n < 60; ++n) {
        CAPTURE(n, failures);
        const Numbers kept = method.memory();
        REQUIRE(method.step(system, n * kInterval, kInterval, x.data(), x_next.data()) ==
                StepStatus::kDone);
        require_close(x_next.data(), plain.state_at(n * kInterval + kInterval));
        const Numbers memory = method.memory();
        REQUIRE(memory.size() == 6 + 4 * x.size() + 1);
        require_close(memory.data(), {plain.t, plain.h, plain.h_next, plain.error_before,
                                      plain.repeated ? 1.0 : 0.0, 0});
        const Numbers* const parts[] = {&plain.x, &plain.y, &plain.slope, &plain.last_slope};
        for (std::size_t part = 0; part < 4; ++part)
          require_close(memory.data() + 6 + part * x.size(), *parts[part]);
        CHECK(memory.back() == static_cast<double>(plain.solved));
        const Effort effort = method.effort();
        REQUIRE(effort.steps == plain.steps);
        REQUIRE(effort.rejected == plain.rejected);
        REQUIRE(effort.newton == plain.solved);
        REQUIRE(effort.evaluations == 1);
        // It goes on from what was kept with the same bits.
        if (n > 0) {
          AdaptiveImplicit second(kPair, kOrder, tolerance, {});
          second.prepare(system);
          second.recall(kept);
          REQUIRE(second.memory() == kept);
          REQUIRE(second.step(system, n * kInterval, kInterval, x.data(), other.data()) ==
                  StepStatus::kDone);
          REQUIRE(std::equal(other.data(), other.data() + x.size(), x_next.data()));
          REQUIRE(second.memory() == memory);
        }
        std::swap(x, x_next);
      }
      CHECK(plain.rejected > failures);
    }
}

TEST_CASE("what an adaptive implicit method cannot take back begins anew") {
  DrivenSystem system(kStiffRates);
  const std::size_t size = kStiffRates.size();
  Numbers good{0.2, 0.1, 0.05, 0.5, 0, 0};
  for (std::size_t i = 0; i < 4 * size; ++i) good.push_back(0.1 * static_cast<double>(i));
  good.push_back(3);
  AdaptiveImplicit method(kPair, kOrder, {}, {});
  method.prepare(system);
  const auto taken = [&](const Numbers& memory) {
    method.recall(memory);
    return !method.memory().empty();
  };
  CHECK(taken(good));
  CHECK(taken({good.begin(), good.end() - 1}));
  CHECK_FALSE(taken({good.begin(), good.end() - 2}));
  CHECK_FALSE(taken({}));
  for (const auto& [place, least] : {std::pair(1, 0.0), {2, 1e-9}, {3, 1e-9}, {5, 0.0}}) {
    Numbers changed = good;
    changed[slot(place)] = least;
    CHECK(taken(changed));
    changed[slot(place)] = place == 1 || place == 5 ? -1e-9 : 0;
    CHECK_FALSE(taken(changed));
    changed[slot(place)] = std::nan("");
    CHECK_FALSE(taken(changed));
  }
  // The step that is kept is from 0.2 s to 0.3 s.
  Array x = beginning(), x_next(size);
  const auto begins = [&](double t) {
    method.recall(good);
    const std::int64_t before = system.evaluations;
    REQUIRE(method.step(system, t, 0.02, x.data(), x_next.data()) == StepStatus::kDone);
    return system.evaluations > before;
  };
  CHECK(begins(0.179));
  CHECK_FALSE(begins(0.181));
  CHECK_FALSE(begins(0.3 + 0.009 * 0.12));
  CHECK(begins(0.3 + 0.011 * 0.12));
}

TEST_CASE("equations that have no solution end an adaptive implicit step where it is too small") {
  DrivenSystem system(kStiffRates);
  AdaptiveImplicit method(kPair, kOrder, {.atol = 1e-3, .rtol = 1e-3}, {});
  method.prepare(system);
  Array x = beginning(), x_next(x.size());
  REQUIRE(method.step(system, 0, 0.1, x.data(), x_next.data()) == StepStatus::kDone);
  const Numbers before = method.memory();
  std::swap(x, x_next);
  system.failures = 1000;
  const std::int64_t rejected = method.effort().rejected;
  CHECK(method.step(system, 0.1, 0.5, x.data(), x_next.data()) == StepStatus::kStepTooSmall);
  CHECK(std::equal(x.data(), x.data() + x.size(), x_next.data()));
  // A fifth each time, down to 1e-13 of the first.
  CHECK(method.effort().rejected - rejected == 19);
  system.failures = 0;
  CHECK(method.step(system, 0.1, 0.5, x.data(), x_next.data()) == StepStatus::kDone);
}

TEST_CASE("diagonally implicit steps and those of BDF2 are their formulas") {
  DrivenSystem system(kStiffRates);
  // The last stage is not the next state, and the first is not explicit.
  constexpr Tableau<2> kTableau{.a = {{{0.3}, {0.4, 0.2}}}, .b = {0.65, 0.35}, .c = {0.3, 0.6}};
  DiagonallyImplicit method(kTableau, 1, {});
  method.prepare(system);
  Array x = beginning(), x_next(x.size());
  constexpr double kT = 0.7, kH = 0.05;
  REQUIRE(method.step(system, kT, kH, x.data(), x_next.data()) == StepStatus::kDone);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double first = system.solution(kT + 0.3 * kH, 0.3 * kH, x[i], i);
    const double k = (first - x[i]) / (0.3 * kH), r = x[i] + 0.4 * kH * k;
    const double second = system.solution(kT + 0.6 * kH, 0.2 * kH, r, i);
    const double l = (second - r) / (0.2 * kH);
    CHECK(x_next[i] == Approx(x[i] + kH * (0.65 * k + 0.35 * l)).epsilon(1e-12));
  }
  CHECK(method.effort().steps == 1);
  CHECK(method.effort().newton == 2);
  CHECK(method.effort().evaluations == 0);

  DiagonallyImplicit explicit_first(kPair.method, 1, {});
  explicit_first.prepare(system);
  REQUIRE(explicit_first.step(system, kT, kH, x.data(), x_next.data()) == StepStatus::kDone);
  PlainImplicit plain{.system = system, .tolerance = {.atol = 1e9, .rtol = 0}};
  plain.begin(kT, {x.data(), x.data() + x.size()});
  plain.h_next = kH;
  plain.take_step();
  require_close(x_next.data(), plain.y, 1e-12);
  CHECK(explicit_first.effort().evaluations == 1);

  // The search for a stage begins with the slope of the one before.
  EsdirkStages stages(kPair, kOrder, {});
  stages.prepare(system);
  stages.restart();
  system.records = true;
  Array slope(x.size()), y(x.size()), error(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) slope[i] = system.slope(kT, x[i], i);
  REQUIRE(stages.step(system, kT, kH, x.data(), slope.data(), y.data(), error.data()) ==
          StepStatus::kDone);
  REQUIRE(system.guesses.size() == kStages - 1);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto& a = kPair.method.a;
    const double first = x[i] + kH * a[1][0] * slope[i], tau = 0.25 * kH;
    CHECK(system.guesses[0][i] == Approx(first + tau * slope[i]).epsilon(1e-12));
    const double k = (system.solution(kT + 0.5 * kH, tau, first, i) - first) / tau,
                 second = x[i] + kH * (a[2][0] * slope[i] + a[2][1] * k);
    CHECK(system.guesses[1][i] == Approx(second + tau * k).epsilon(1e-12));
  }
  system.records = false;

  constexpr Tableau<1> kBackwardEuler{.a = {{{1}}}, .b = {1}, .c = {1}};
  Bdf2 bdf({}, std::make_unique<DiagonallyImplicit>(kBackwardEuler, 1, StageOptions{}));
  bdf.prepare(system);
  Array last(x.size());
  Numbers kept;
  for (int n = 0; n < 6; ++n) {
    CAPTURE(n);
    // The size of the fourth step is another one, with which it begins anew.
    const double h = n < 3 ? kH : 0.5 * kH, t = n < 3 ? kT + n * kH : kT + 1.5 * kH + n * h;
    REQUIRE(bdf.step(system, t, h, x.data(), x_next.data()) == StepStatus::kDone);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double expected =
          n == 0 || n == 3 ? system.solution(t + h, h, x[i], i)
                           : system.solution(t + h, 2 * h / 3, x[i] + (x[i] - last[i]) / 3, i);
      CHECK(x_next[i] == Approx(expected).epsilon(1e-12));
    }
    if (n == 5) {
      Bdf2 second({}, std::make_unique<DiagonallyImplicit>(kBackwardEuler, 1, StageOptions{}));
      second.prepare(system);
      second.recall(kept);
      CHECK(second.memory() == kept);
      Array other(x.size());
      REQUIRE(second.step(system, t, h, x.data(), other.data()) == StepStatus::kDone);
      CHECK(std::equal(other.data(), other.data() + x.size(), x_next.data()));
      kept.resize(x.size());
      second.recall(kept);
      CHECK(second.memory().empty());
    }
    std::swap(last, x);
    std::swap(x, x_next);
    kept = bdf.memory();
    CHECK(kept.size() == x.size() + 2);
    CHECK(kept.front() == h);
  }
  CHECK(bdf.effort().steps == 6);
}

// |R(z)| of each root, z = h lambda, by a step of the system itself.
TEST_CASE("the growth of implicit steps is what a step makes of a number") {
  constexpr Tableau<2> kTableau{.a = {{{0.3}, {0.4, 0.2}}}, .b = {0.65, 0.35}, .c = {0.3, 0.6}};
  const DiagonallyImplicit method(kTableau, 1, {});
  for (const double fast : {-0.5, -3.0, -40.0})
    for (const double slow : {-0.1, -0.4}) {
      const auto growth = [](double z) {
        const double k = z / (1 - 0.3 * z), l = z * (1 + 0.4 * k) / (1 - 0.2 * z);
        return std::fabs(1 + 0.65 * k + 0.35 * l);
      };
      const double omega = std::sqrt(fast * slow), gamma = -(fast + slow);
      CHECK(method.amplification(omega, gamma) ==
            Approx(std::max(growth(fast), growth(slow))).epsilon(1e-12));
      // zeta^2 - 4/3 zeta + 1/3 = 2/3 z zeta^2
      const auto root = [](double z) {
        const double square = 16.0 / 9 - 4.0 / 3 * (1 - 2 * z / 3), a = 1 - 2 * z / 3;
        if (square < 0) return std::sqrt(1 / (3 * a));
        return std::max(std::fabs(4.0 / 3 + std::sqrt(square)),
                        std::fabs(4.0 / 3 - std::sqrt(square))) /
               (2 * a);
      };
      const Bdf2 bdf({}, nullptr);
      CHECK(bdf.amplification(omega, gamma) ==
            Approx(std::max(root(fast), root(slow))).epsilon(1e-12));
    }
}
