// How fine the run after one that missed an error is, where errors fall as claimed, more slowly, or
// not at all.
#include <catch2/catch.hpp>

#include "core/study/accuracy/mending.h"

using namespace sim::study;

namespace {

Refinement of_order(int order, bool adaptive = false) {
  Candidate method;
  method.info.order = order;
  method.info.adaptive = method.has_tolerance = adaptive;
  return Refinement(method);
}

constexpr double kMuch = 1e9;  // evaluations

}  // namespace

TEST_CASE("a run that missed is repeated as finely as its order asks", "[mending]") {
  // Errors of order 2 aim at 0.7 of the one allowed: (4 / 0.7)^(1/2) times as many steps.
  Mending mending(of_order(2), 2, {.allowed = 1});
  CHECK(mending.after(100, 4, 200, kMuch).value() == Approx(100 * std::sqrt(4 / 0.7)));
  CHECK(mending.cost() == Approx(200 * std::sqrt(4 / 0.7)));
  // It fell as 1/n, from 4 to 2 with twice the steps: (2 / 0.49)^1 times as many.
  CHECK(mending.after(200, 2, 400, kMuch).value() == Approx(200 * 2 / 0.49));
  CHECK(mending.exponent() == Approx(1));

  // A second miss is repeated with twice the steps at least.
  Mending close(of_order(4), 4, {.allowed = 1});
  CHECK(close.after(100, 16, 400, kMuch).value() == Approx(100 * std::pow(16 / 0.7, 0.25)));
  CHECK(close.after(200, 1.01, 800, kMuch).value() == 400);

  // A tolerance of 1/n costs n^(1/p).
  Mending by_tolerance(of_order(5, true), 1, {.allowed = 1});
  CHECK(by_tolerance.after(1e3, 7, 200, kMuch).value() == Approx(1e4));
  CHECK(by_tolerance.cost() == Approx(200 * std::pow(10, 0.2)));

  // A run that is not finite is refined once.
  CHECK(Mending(of_order(2), 2, {.allowed = 1}).after(100, HUGE_VAL, 200, kMuch).value() ==
        Approx(200));
}

TEST_CASE("runs become at most 64 times as fine at once, and no finer than was enough",
          "[mending]") {
  CHECK(Mending(of_order(1), 1, {.allowed = 1}).after(100, 1e6, 200, kMuch).value() == 6400);
  CHECK(
      Mending(of_order(1), 1, {.allowed = 1, .enough = 300}).after(100, 1e6, 200, kMuch).value() ==
      300);
  CHECK_FALSE(Mending(of_order(1), 1, {.allowed = 1, .finest = 6000}).after(100, 1e6, 200, kMuch));
  CHECK_FALSE(
      Mending(of_order(1), 1, {.allowed = 1, .most_cost = 1e4}).after(100, 1e6, 200, kMuch));
}

TEST_CASE("where errors no longer fall, a run is as fine as is free", "[mending]") {
  Mending mending(of_order(4), 4, {.allowed = 1});
  CHECK(mending.after(1000, 3, 4000, 8000).value() < 1500);  // the order is believed at first
  CHECK(mending.after(1440, 3, 5760, 57600).value() == Approx(14400));
  CHECK(mending.exponent() == kLeastExponent);
  CHECK(mending.cost() == Approx(57600));
  // One that is less than twice as fine says nothing.
  CHECK_FALSE(mending.after(14400, 3, 57600, 57600));
  // Errors that fall again are followed, whatever is free.
  CHECK(mending.after(30000, 1.5, 120000, 0).value() > 60000);

  // Twice the cost are 2^5 times the tolerance.
  Mending by_tolerance(of_order(5, true), 1, {.allowed = 1});
  CHECK(by_tolerance.after(1e3, 3, 200, kMuch));
  CHECK(by_tolerance.after(5e3, 3, 300, 600).value() == Approx(32 * 5e3));
}
