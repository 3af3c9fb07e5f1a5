// Sizes of adaptive steps, value by value.
#include "core/ode/explicit/step_controller.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace sim;

namespace {

// The size after a step of 2 s with that error.
double next_size(int k, double error, double error_before, bool repeated = false) {
  StepController controller(k);
  controller.state = {.h = 2, .error_before = error_before, .repeated = repeated};
  controller.accept(error);
  return controller.state.h;
}

}  // namespace

TEST_CASE("the step after one that stands follows its error and the one before") {
  for (const int k : {2, 3, 5, 8})
    for (const double before : {1.0, 0.3, 1e-4})
      for (const double error : {1.0, 0.7, 0.4, 0.05}) {
        CAPTURE(k, before, error);
        const double factor = 0.9 * std::pow(error, -0.7 / k) * std::pow(before, 0.4 / k);
        CHECK(next_size(k, error, before) ==
              Approx(2 * std::min(5.0, std::max(0.2, factor))).epsilon(1e-13));
        // Right after one was rejected it never grows.
        CHECK(next_size(k, error, before, true) ==
              Approx(2 * std::min(1.0, std::max(0.2, factor))).epsilon(1e-13));
      }
  CHECK(next_size(2, 1e-9, 1) == 10);
  CHECK(next_size(2, 0, 1) == 10);
  CHECK(next_size(1, 1, 1e-4) == 0.4);  // 0.9 * 1e-4^0.4 is less than a fifth
}

TEST_CASE("a rejected step is tried again shorter, to a fifth at most") {
  for (const int k : {2, 3, 5, 8})
    for (const double error : {1 + 1e-12, 1.5, 7.0, 200.0, 1e29}) {
      CAPTURE(k, error);
      const double factor = std::max(0.2, 0.9 * std::pow(error, -1.0 / k));
      CHECK(next_size(k, error, 0.3) == Approx(2 * factor).epsilon(1e-13));
    }
  CHECK(next_size(2, HUGE_VAL, 1) == 0.4);
  CHECK(next_size(2, std::nan(""), 1) == 0.4);
  CHECK(next_size(40, 1e31, 1) == 0.4);
}

TEST_CASE("errors of steps that stand are kept, those of rejected ones are not") {
  StepController controller(4);
  controller.state = {.h = 1, .error_before = 0.5};
  CHECK_FALSE(controller.accept(1 + 1e-15));
  CHECK(controller.state.repeated);
  CHECK(controller.state.error_before == 0.5);
  CHECK(controller.accept(1));
  CHECK_FALSE(controller.state.repeated);
  CHECK(controller.state.error_before == 1);
  CHECK(controller.accept(0.25));
  CHECK(controller.state.error_before == 0.25);
  CHECK(controller.accept(1e-7));
  CHECK(controller.state.error_before == 1e-4);
}
