// Backward differentiation formulas against the polynomials that define them: the history of a step
// is given, and what one step makes of it is read back.
#include "plugins/integrators/bdf/multistep.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/slot.h"
#include "tests/ode/driven_system.h"

using namespace sim;
using sim_test::DrivenSystem;

namespace {

using Numbers = std::vector<double>;

// sum_j kFormula[q - 1][j] x(t - j h) = h x'(t), of order q. Gear (1971).
const std::array<Numbers, 5> kFormula{{{1, -1},
                                       {1.5, -2, 0.5},
                                       {11.0 / 6, -3, 1.5, -1.0 / 3},
                                       {25.0 / 12, -4, 3, -4.0 / 3, 0.25},
                                       {137.0 / 60, -5, 5, -10.0 / 3, 1.25, -0.2}}};

// The contents of memory() for one number.
struct History {
  double t = 0.2, h = 0, next_h = 0;
  int order = 1, next_order = 1, wait = 9;
  double growth = 10, saved_scale = 0;
  Numbers past = {}, z = {}, saved = {0};

  Numbers numbers() const {
    Numbers all{t,
                h,
                next_h,
                static_cast<double>(order),
                static_cast<double>(next_order),
                static_cast<double>(wait),
                growth,
                saved_scale};
    for (const Numbers* list : {&past, &z, &saved})
      all.insert(all.end(), list->begin(), list->end());
    all.push_back(0);  // of the solver
    return all;
  }
  static History of(const Numbers& all) {
    History read{.t = all[0], .h = all[1], .next_h = all[2], .order = static_cast<int>(all[3])};
    read.next_order = static_cast<int>(all[4]);
    read.wait = static_cast<int>(all[5]);
    read.growth = all[6];
    read.saved_scale = all[7];
    read.past.assign(all.begin() + 8, all.begin() + 14);
    read.z.assign(all.begin() + 14, all.begin() + 20);
    read.saved = {all[20]};
    return read;
  }
  double at(double time) const {
    double sum = 0;
    for (int j = order; j >= 0; --j) sum = sum * (time - t) / h + z[slot(j)];
    return sum;
  }
  // t_(n-j)
  double time(int j) const {
    double sum = t;
    for (int i = 0; i < j; ++i) sum -= past[slot(i)];
    return sum;
  }
};

History history(int order, bool equal) {
  History made{.h = 0.01, .next_h = 0.01, .order = order, .next_order = order};
  made.past = equal ? Numbers(6, 0.01) : Numbers{0.01, 0.007, 0.013, 0.009, 0.012, 0.008};
  if (!equal) made.next_h = 0.0115;
  made.z = {1.3, 0.4, -0.3, 0.2, -0.15, 0.1};
  for (int j = order + 1; j <= 5; ++j) made.z[slot(j)] = 0;
  return made;
}

struct Step {
  Bdf method;
  History after = {};
  double x_next = 0;
  StepStatus status = StepStatus::kNotConverged;
};

constexpr double kRate = -7;
constexpr double kPart = 0.05;  // of a step, after which the state is asked for

// One step from a history.
Step step_from(const History& before, double atol, double max_step = HUGE_VAL, int failures = 0) {
  DrivenSystem system({kRate});
  system.failures = failures;
  Step step{.method = Bdf({.atol = atol, .rtol = 0, .max_step = max_step}, {})};
  step.method.prepare(system);
  step.method.recall(before.numbers());
  REQUIRE(step.method.memory() == before.numbers());
  const double x = before.at(before.t), interval = (failures > 0 ? 0.01 : kPart) * before.next_h;
  step.status = step.method.step(system, before.t, interval, &x, &step.x_next);
  step.after = History::of(step.method.memory());
  return step;
}

double harmonic(int n) { return n == 0 ? 0 : harmonic(n - 1) + 1.0 / n; }
double factorial(int n) { return n == 0 ? 1 : n * factorial(n - 1); }

// Checks a step of order q from the predicted polynomial.
void check_step(const History& predicted, int q, const Step& step) {
  const DrivenSystem system({kRate});
  const History& after = step.after;
  REQUIRE(step.status == StepStatus::kDone);
  const double h = after.h, t = after.t;
  CHECK(t == Approx(predicted.t + h).epsilon(1e-14));
  // The formula holds with the values of the predicted polynomial in equal steps.
  double sum = h * system.drive(t, 0);
  for (int j = 1; j <= q; ++j) sum -= kFormula[slot(q - 1)][slot(j)] * predicted.at(t - j * h);
  const double x = sum / (kFormula[slot(q - 1)][0] - h * kRate);
  CHECK(after.z[0] == Approx(x).epsilon(1e-12));
  CHECK(after.z[1] == Approx(h * system.slope(t, x, 0)).epsilon(1e-11));
  CHECK(after.past[0] == h);
  for (int j = 1; j < 6; ++j) CHECK(after.past[slot(j)] == predicted.past[slot(j - 1)]);
  // It goes through the states before, all but the last one of its degree.
  for (int j = 1; j < q; ++j)
    CHECK(after.at(after.time(j)) == Approx(predicted.at(after.time(j))).epsilon(1e-12));
  // The state inside of the step.
  CHECK(step.x_next == Approx(after.at(predicted.t + kPart * predicted.next_h)).epsilon(1e-12));
}

}  // namespace

TEST_CASE("a step of each order fulfils its formula and leads the history on") {
  for (const bool equal : {true, false})
    for (int q = 1; q <= 5; ++q) {
      CAPTURE(equal, q);
      const History before = history(q, equal);
      check_step(before, q, step_from(before, 1e3));
    }
}

TEST_CASE("another order keeps the states before, those that the formula of that order has") {
  for (const bool equal : {true, false})
    for (int q = 1; q <= 5; ++q)
      for (const int next : {q - 1, q + 1}) {
        if (next < 1 || next > 5) continue;
        CAPTURE(equal, q, next);
        History before = history(q, equal);
        before.next_order = next;
        before.saved = {0.37};
        History predicted = before;
        const auto xi = [&](int j) { return (before.t - before.time(j)) / before.h; };
        // K x^2 prod (x + xi_j) is added; where the order grows it takes out of t_(n-q) what the
        // last correction put there.
        const int factors = std::min(q, next) - 1;
        Numbers added(8, 0);
        added[2] = 1;
        for (int j = 1; j <= factors; ++j)
          for (std::size_t i = 7; i >= 2; --i) added[i] = xi(j) * added[i] + added[i - 1];
        double size = -before.z[slot(q)];
        if (next > q) {
          double inverse = harmonic(q), there = xi(q) * xi(q);
          double of_correction = 1;
          for (int j = 1; j < q; ++j) {
            inverse -= 1 / xi(j);
            of_correction *= 1 - xi(q) / xi(j);
            there *= xi(j) - xi(q);
          }
          size = -before.saved[0] * of_correction * (1 - xi(q) * inverse) / there;
        }
        for (std::size_t i = 0; i < 6; ++i) predicted.z[i] += size * added[i];
        predicted.order = next;
        for (int j = 0; j <= factors; ++j)
          CHECK(predicted.at(before.time(j)) == Approx(before.at(before.time(j))).epsilon(1e-12));
        const Step step = step_from(before, 1e3);
        check_step(predicted, next, step);
        CHECK(step.after.order == next);
        CHECK(step.after.wait == next);  // next + 1 steps of it, of which this was one
      }
}

// In equal steps the errors of the orders q - 1, q and q + 1 are (q-1)! / H_(q-1) z_q,
// e / (H_q (q + 1)) and (e - saved) / ((q + 2) H_(q+1)), H_n = 1 + 1/2 + .. + 1/n.
TEST_CASE("a step stands to its tolerance, and the next is as long as its error lets it be") {
  for (int q = 1; q <= 5; ++q) {
    CAPTURE(q);
    History before = history(q, true);
    for (int j = q - 1; j < 6; ++j) before.past[slot(j)] = 0.02;  // steps that do not count
    const Step free = step_from(before, 1e3);
    double predicted = 0;
    for (const double z : before.z) predicted += z;
    const double e = free.after.z[0] - predicted;
    const double limit = std::fabs(e) / (harmonic(q) * (q + 1));
    CHECK(step_from(before, limit * (1 + 1e-9)).method.effort().rejected == 0);
    CHECK(step_from(before, limit * (1 - 1e-9)).method.effort().rejected >= 1);
    // Rejected once: shorter by the error, within bounds.
    for (const double error : {1.01, 3.0, 1e4}) {
      const double shrink = std::pow(6 * error, -1.0 / (q + 1));
      const Step again = step_from(before, limit / error);
      if (again.method.effort().rejected == 1)
        CHECK(again.after.h ==
              Approx(before.h * std::min(0.9, std::max(0.1, shrink))).epsilon(1e-12));
    }
    for (const double error : {1e-2, 1e-3, 1e-6}) {
      const double growth = 1 / (std::pow(6 * error, 1.0 / (q + 1)) + 1e-6);
      const History after = step_from(before, limit / error).after;
      CHECK(after.next_h ==
            Approx(before.h * (growth < 1.5 ? 1 : std::min(growth, 10.0))).epsilon(1e-10));
      CHECK(after.next_order == q);
      CHECK(after.wait == 8);
      CHECK(after.growth == 10);
      CHECK(step_from(before, limit / error, 1.01 * before.h).after.next_h ==
            Approx(std::min(1.01 * before.h, after.next_h)));
    }
    // On both sides of what a change is worth.
    before.saved_scale = 3;
    for (const double growth : {1.49, 1.51}) {
      const double error = std::pow(1 / growth - 1e-6, q + 1) / 6;
      const History after = step_from(before, limit / error).after;
      CHECK(after.saved_scale == 3);
      CHECK(after.next_h == Approx(growth < 1.5 ? before.h : growth * before.h).epsilon(1e-9));
    }
    before.saved_scale = 0;
    // After a failure nothing grows.
    before.growth = 1;
    before.wait = 2;
    const History held = step_from(before, 1e3 * limit).after;
    CHECK(held.next_h == before.h);
    CHECK(held.wait == 2);
    before.growth = 10;
    const History kept = step_from(before, 1e3 * limit).after;
    CHECK(kept.wait == 1);
    // One step before another order is thought of, its correction is kept with its scale.
    if (q < 5) {
      CHECK(kept.saved[0] == Approx(e).epsilon(1e-11));
      CHECK(kept.saved_scale == Approx(factorial(q + 1)).epsilon(1e-12));
    } else {
      CHECK(kept.saved == before.saved);
      CHECK(kept.saved_scale == 0);
    }
  }
}

TEST_CASE("the order is the one whose step is longest") {
  int lower = 0, higher = 0, same = 0;
  for (int q = 1; q <= 5; ++q)
    for (const double last : {1e-9, 1e-3, 0.03, 1.0})
      for (const double saved : {0.0, 0.5, 0.99, 5.0})
        for (const double scale : {0.0, 0.5, 1.0})
          for (const double part : {1e-4, 1e-2}) {
            CAPTURE(q, last, saved, scale, part);
            History before = history(q, true);
            before.z[slot(q)] *= last;
            before.wait = 1;
            before.growth = 1e4;
            for (int j = q; j < 6; ++j) before.past[slot(j)] = 0.02;  // steps that do not count
            const Step free = step_from(before, 1e6);
            double predicted = 0;
            for (const double z : before.z) predicted += z;
            const double e = free.after.z[0] - predicted;
            const double atol = std::fabs(e) / (harmonic(q) * (q + 1)) / part;
            before.saved = {saved * e};
            before.saved_scale = scale * factorial(q + 1);
            const auto growth = [](double bias, double error, int root) {
              return 1 / (std::pow(bias * error, 1.0 / root) + 1e-6);
            };
            double best = growth(6, part, q + 1);
            int order = q;
            if (q > 1) {
              const double error =
                  factorial(q - 1) / harmonic(q - 1) * std::fabs(free.after.z[slot(q)]) / atol;
              if (growth(6, error, q) > best) best = growth(6, error, q), order = q - 1;
            }
            if (q < 5 && scale > 0) {
              const double error =
                  std::fabs(e - saved * e / scale) / ((q + 2) * harmonic(q + 1)) / atol;
              if (growth(10, error, q + 2) > best) best = growth(10, error, q + 2), order = q + 1;
            }
            if (best < 1.5 || saved == scale) continue;  // nothing left but roundings
            const History after = step_from(before, atol).after;
            CHECK(after.next_order == order);
            CHECK(after.next_h == Approx(best * before.h).epsilon(1e-6));
            CHECK(after.wait == 2);
            ++(order < q ? lower : order > q ? higher : same);
          }
  CHECK(lower > 10);
  CHECK(higher > 10);
  CHECK(same > 10);
}

TEST_CASE("a first step changes the state by half of the tolerance, and the next is much longer") {
  DrivenSystem system({kRate});
  for (const double max_step : {HUGE_VAL, 1e-12}) {
    Bdf method({.atol = 1e-10, .rtol = 0, .max_step = max_step}, {});
    method.prepare(system);
    const double x = 2;
    double x_next = 0;
    REQUIRE(method.step(system, 0.2, 1e-13, &x, &x_next) == StepStatus::kDone);
    const History after = History::of(method.memory());
    const double h = std::min(0.5e-10 / std::fabs(system.slope(0.2, x, 0)), max_step);
    CHECK(after.past[0] == Approx(h).epsilon(1e-12));
    CHECK(after.next_h == Approx(std::min(1e4 * h, max_step)).epsilon(1e-9));
    CHECK(after.growth == 10);
    CHECK(x_next == Approx(x + 1e-13 * system.slope(0.2, x, 0)).epsilon(1e-15));
  }
}

TEST_CASE("equations without a solution make the step a quarter, which does not grow then") {
  for (int q = 1; q <= 5; ++q)
    for (const int failures : {1, 2}) {
      CAPTURE(q, failures);
      const History before = history(q, true);
      const Step step = step_from(before, 1e3, HUGE_VAL, failures);
      REQUIRE(step.status == StepStatus::kDone);
      CHECK(step.method.effort().rejected == failures);
      CHECK(step.after.h == Approx(before.h * std::pow(0.25, failures)).epsilon(1e-14));
      CHECK(step.after.next_h == step.after.h);
      CHECK(step.after.order == q);
    }
}

TEST_CASE(
    "after three errors that are too large the order falls, and of order 1 the slope is new") {
  for (const int q : {1, 3}) {
    CAPTURE(q);
    int found = 0;
    for (double atol = 1; atol > 1e-9; atol *= 0.7) {
      History before = history(q, true);
      for (int j = 2; j <= q; ++j) before.z[slot(j)] *= 30;
      DrivenSystem system({kRate});
      Bdf method({.atol = atol, .rtol = 0}, {});
      method.prepare(system);
      method.recall(before.numbers());
      const double x = before.at(before.t);
      double x_next = 0;
      REQUIRE(method.step(system, before.t, 1e-9, &x, &x_next) == StepStatus::kDone);
      if (method.effort().steps != 1 || method.effort().rejected != 3) continue;
      const History after = History::of(method.memory());
      const double first = after.h / before.h;
      CHECK(after.order == std::max(1, q - 1));
      CHECK(first <= 0.1 * 0.9 * 0.9);
      CHECK(first >= 0.999e-3);
      CHECK(after.next_h == after.h);
      CHECK(after.wait == (q == 1 ? 9 : std::max(2, q - 1)));
      CHECK(system.evaluations == (q == 1 ? 1 : 0));
      ++found;
    }
    CHECK(found > 0);
  }
}

TEST_CASE("a history that cannot be is not taken, and one of another time begins anew") {
  DrivenSystem system({kRate});
  const auto taken = [&](const Numbers& memory) {
    Bdf method({.atol = 1e-3, .rtol = 0}, {});
    method.prepare(system);
    method.recall(memory);
    return !method.memory().empty();
  };
  const Numbers good = history(3, true).numbers();
  CHECK(taken(good));
  CHECK(taken({good.begin(), good.end() - 1}));  // of the solver
  CHECK_FALSE(taken({good.begin(), good.end() - 2}));
  CHECK_FALSE(taken({}));
  const auto with = [&](std::size_t place, double value) {
    Numbers changed = good;
    changed[place] = value;
    return taken(changed);
  };
  for (const std::size_t place : {1, 2})
    for (const double bad : {0.0, -0.1, HUGE_VAL}) CHECK_FALSE(with(place, bad));
  for (const double bad : {0.0, 6.0, -1.0, 1e300}) CHECK_FALSE(with(3, bad));
  for (const double order : {1.0, 5.0}) CHECK_FALSE(with(4, order));  // two from the present one
  for (const double order : {2.0, 3.0, 4.0}) CHECK(with(4, order));
  for (const double wait : {-1.0, 100.0}) CHECK_FALSE(with(5, wait));
  for (const double wait : {0.0, 99.0}) CHECK(with(5, wait));
  CHECK_FALSE(with(16, std::nan("")));

  // The step before is of 0.01 s and ends at 0.2 s.
  const auto fresh = [&](double t) {
    Bdf method({.atol = 1e3, .rtol = 0}, {});
    method.prepare(system);
    method.recall(good);
    const double x = 2;
    double x_next = 0;
    REQUIRE(method.step(system, t, 0.02, &x, &x_next) == StepStatus::kDone);
    return method.memory()[3] == 1;
  };
  CHECK(fresh(0.169));
  CHECK_FALSE(fresh(0.171));
  CHECK_FALSE(fresh(0.2 + 0.009 * 0.03));
  CHECK(fresh(0.2 + 0.011 * 0.03));
}
