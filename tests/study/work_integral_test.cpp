// The work of a power that is looked at now and then.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/study/work_integral.h"

using namespace sim;

TEST_CASE("the work of a power that is a cubic is exact at any looks, that of others doubted") {
  const auto power = [](double t) { return 2 - t + 3 * t * t - 4 * t * t * t; };
  const auto work = [](double t) { return 2 * t - t * t / 2 + t * t * t - t * t * t * t; };
  const double times[] = {0.1, 0.25, 0.3, 0.5, 0.62, 0.9, 1, 1.3, 1.35};
  study::WorkIntegral integral;
  CHECK(integral.value() == 0);
  int looks = 0;
  double by_parabolas = 0;
  for (const double t : times) {
    CAPTURE(t);
    study::WorkIntegral again;
    REQUIRE(again.recall(integral.memory()));
    const double expected = integral.with(t, power(t));
    again.look(t, power(t));
    integral.look(t, power(t));
    CHECK(integral.value() == expected);
    CHECK(again.memory() == integral.memory());
    ++looks;
    if (looks == 2) CHECK(integral.value() == Approx(0.5 * (power(0.1) + power(t)) * (t - 0.1)));
    if (looks >= 4) CHECK(integral.value() == Approx(work(t) - work(0.1)).epsilon(1e-12));
    CHECK(integral.settled() == (looks >= 4));
    CHECK(std::isinf(integral.doubt()) == (looks <= 4));
    CHECK(std::isinf(integral.uncertainty()) == (looks < 7));
    // A cubic less the parabola through three is its leading term times the three roots.
    if (looks >= 4) {
      const double a = times[looks - 3], b = times[looks - 2], c = t, mid = 0.5 * (b + c);
      const auto rest = [&](double at) { return -4 * (at - a) * (at - b) * (at - c); };
      const double off = (c - b) / 6 * (rest(b) + 4 * rest(mid) + rest(c));
      if (looks > 4) CHECK(integral.doubt() == Approx(std::fabs(off)).epsilon(1e-9));
      by_parabolas += off;
    } else if (looks == 3) {
      by_parabolas = work(t) - work(0.1) - integral.value();
    }
    if (looks >= 7)
      CHECK(integral.uncertainty() == Approx(2 * std::fabs(by_parabolas)).epsilon(1e-9));
  }
  // Another part begins with no history, and adds up.
  const double first = integral.value(), doubt = integral.uncertainty();
  integral.part();
  CHECK(integral.value() == first);
  CHECK(integral.uncertainty() == doubt);
  CHECK(integral.settled());
  integral.look(2, 10);
  integral.look(2.5, 20);
  CHECK(integral.value() == Approx(first + 7.5));
  study::WorkIntegral again;
  REQUIRE(again.recall(integral.memory()));
  CHECK(again.value() == integral.value());
  CHECK(again.memory() == integral.memory());
  std::vector<double> numbers = integral.memory();
  numbers.pop_back();
  CHECK_FALSE(again.recall(numbers));
  numbers.pop_back();
  CHECK(again.recall(numbers));
  numbers[0] = -1;
  CHECK_FALSE(again.recall(numbers));
  numbers[0] = 1e15;
  CHECK_FALSE(again.recall(numbers));
}
