// Sizes of adaptive steps, value by value.
#include "core/ode/explicit/step_controller.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace sim;

namespace {

// The powers are quick ones; what a controller decides need not be exact.
constexpr double kOfPowers = 2e-8;

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
              Approx(2 * std::min(5.0, std::max(0.2, factor))).epsilon(kOfPowers));
        // Right after one was rejected it never grows.
        CHECK(next_size(k, error, before, true) ==
              Approx(2 * std::min(1.0, std::max(0.2, factor))).epsilon(kOfPowers));
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
      CHECK(next_size(k, error, 0.3) == Approx(2 * factor).epsilon(kOfPowers));
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

TEST_CASE("predictive control expects that errors grow as they did") {
  using Control = StepController::Control;
  const auto next = [](int k, double error, double before, double h_before, bool repeated = false) {
    StepController controller(k, Control::kPredictive);
    controller.state = {.h = 2, .error_before = before, .repeated = repeated};
    REQUIRE(controller.accept(error, h_before));
    return controller.state.h;
  };
  for (const int k : {2, 4})
    for (const double before : {1.0, 0.3, 1e-2})
      for (const double error : {1.0, 0.4, 0.05})
        for (const double h_before : {0.5, 2.0, 3.0, 1e3}) {
          CAPTURE(k, before, error, h_before);
          const double plain = 0.9 * std::pow(error, -1.0 / k);
          const double predicted = plain * 2 / h_before * std::pow(before / error, 1.0 / k);
          const double factor = std::min(plain, predicted);
          CHECK(next(k, error, before, h_before) ==
                Approx(2 * std::min(5.0, std::max(0.2, factor))).epsilon(kOfPowers));
          CHECK(next(k, error, before, h_before, true) ==
                Approx(2 * std::min(1.0, std::max(0.2, factor))).epsilon(kOfPowers));
          CHECK(next(k, error, before, 0) ==
                Approx(2 * std::min(5.0, std::max(0.2, plain))).epsilon(kOfPowers));
        }
  StepController controller(4, Control::kPredictive);
  controller.state = {.h = 1};
  CHECK(controller.accept(1e-7));
  CHECK(controller.state.error_before == 1e-2);
  CHECK_FALSE(controller.accept(16));
  CHECK(controller.state.h == Approx(5 * 0.9 / 2).epsilon(kOfPowers));
  CHECK(controller.state.error_before == 1e-2);
}

// The logarithm of the error before is kept from step to step.
TEST_CASE("a controller that goes on takes the steps of a new one in its state") {
  for (const auto control :
       {StepController::Control::kProportionalIntegral, StepController::Control::kPredictive}) {
    StepController going(4, control);
    going.state = {.h = 1};
    double h_before = 0;
    for (const double error : {0.5, 0.5, 1e-6, 3.0, 0.02, 1e-5, 1e-6, 0.9}) {
      StepController fresh(4, control);
      fresh.state = going.state;
      const double h = going.state.h;
      CHECK(going.accept(error, h_before) == fresh.accept(error, h_before));
      CHECK(going.state.h == fresh.state.h);
      h_before = h;
    }
  }
}
