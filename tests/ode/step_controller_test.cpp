#include "core/ode/step_controller.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace sim;

TEST_CASE("powers have all their digits") {
  for (const double x : {1e-300, 5e-324, 1e-10, 0.5, 0.70710678, 0.99999, 1.0, 1.7, 1e10, 1e300})
    for (const double y : {-0.7 / 5, 0.4 / 5, 1.0 / 9, -1.0 / 3, 1.0}) {
      INFO(x << "^" << y);
      CHECK(power(x, y) == Approx(std::pow(x, y)).epsilon(1e-12));
    }
}

TEST_CASE("steps settle where the error is the tolerance") {
  // error = (h / 0.01)^5, so that 0.01 is the step whose error is just the tolerance.
  StepController controller(5);
  controller.state.h = 1e-6;
  int accepted = 0;
  for (int n = 0; n < 100; ++n)
    accepted += controller.accept(std::pow(controller.state.h / 0.01, 5));
  CHECK(accepted == 100);
  CHECK(controller.state.h < 0.01);
  CHECK(controller.state.h > 0.007);
}

TEST_CASE("errors beyond the tolerance make the step shorter, never longer after it") {
  StepController controller(5);
  controller.state.h = 1;
  CHECK_FALSE(controller.accept(32));  // 32^(1/5) = 2
  CHECK(controller.state.h == Approx(0.45).epsilon(1e-12));
  CHECK(controller.accept(1e-20));
  CHECK(controller.state.h == Approx(0.45).epsilon(1e-12));
  CHECK(controller.accept(1e-20));
  CHECK(controller.state.h > 0.45);

  for (const double bad : {std::nan(""), HUGE_VAL, 1e200}) {
    controller.state.h = 1;
    CHECK_FALSE(controller.accept(bad));
    CHECK(controller.state.h == 0.2);
  }
}

TEST_CASE("an error that rises makes the step shorter than one that stays") {
  StepController rising(5), level(5);
  rising.state = {.h = 1, .error_before = 0.01};
  level.state = {.h = 1, .error_before = 0.5};
  CHECK(rising.accept(0.5));
  CHECK(level.accept(0.5));
  CHECK(rising.state.h < 0.8 * level.state.h);
}
