// The status of an implicit step, from that of its stages and the numbers that they left.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "core/ode/implicit/implicit.h"
#include "core/ode/ode_system.h"

using namespace sim;

namespace {

class Ending final : public StageSolver {
 public:
  Ending(StepStatus status, double left) : status_(status), left_(left) {}
  StepStatus solve(double, double, const double*, double* y) override {
    y[0] = left_;
    return status_;
  }
  Effort effort() const override { return {}; }

 private:
  StepStatus status_;
  double left_;
};

class Scalar final : public OdeSystem {
 public:
  Scalar(StepStatus status, double left) : status_(status), left_(left) {}
  std::size_t size() const noexcept override { return 1; }
  void eval(double, const Stage& stage, double* y, double* dydt) override {
    combine(stage, y);
    dydt[0] = 0;
  }
  void combine(const Stage& stage, double* out) override {
    double sum = stage.x[0];
    for (const auto& term : stage.terms) sum += term.coef * term.k[0];
    out[0] = sum;
  }
  std::unique_ptr<StageSolver> stage_solver(const StageOptions& /*options*/) override {
    return std::make_unique<Ending>(status_, left_);
  }

 private:
  StepStatus status_;
  double left_;
};

constexpr Tableau<1> kBackwardEuler{.a = {{{1}}}, .b = {1}, .c = {1}};

StepStatus ended(StepStatus status, double left) {
  Scalar system(status, left);
  DiagonallyImplicit method(kBackwardEuler, 1, {});
  method.prepare(system);
  const double x = 1;
  double x_next = 0;
  return method.advance(system, 0, 0.1, 1, &x, &x_next).status;
}

}  // namespace

TEST_CASE("a step that did not converge or was stopped says so whatever numbers it left") {
  for (const double left : {2.0, std::numeric_limits<double>::quiet_NaN(), HUGE_VAL}) {
    CAPTURE(left);
    CHECK(ended(StepStatus::kNotConverged, left) == StepStatus::kNotConverged);
    CHECK(ended(StepStatus::kStopped, left) == StepStatus::kStopped);
  }
}

TEST_CASE("whether a step is finite is told by its state alone") {
  CHECK(ended(StepStatus::kDone, 2) == StepStatus::kDone);
  CHECK(ended(StepStatus::kDone, HUGE_VAL) == StepStatus::kNotFinite);
  CHECK(ended(StepStatus::kNotFinite, HUGE_VAL) == StepStatus::kNotFinite);
  CHECK(ended(StepStatus::kNotFinite, 2) == StepStatus::kNotConverged);
}
