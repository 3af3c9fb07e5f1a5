// Backward differentiation formulas of orders 1 to 5 with adaptive steps.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "core/base/array.h"
#include "core/ode/explicit/embedded_rk.h"
#include "core/ode/integrator.h"

namespace sim {

// Steps to |error_i| <= atol + rtol |x_i| with the order that makes them longest. The fixed leading
// coefficient form of Jackson & Sacks-Davis (1980), ACM TOMS 6, 295-318, on the array of Nordsieck,
// z_j = h^j x^(j) / j!, whose coefficients follow from the sizes of the last steps: Byrne &
// Hindmarsh (1975), ACM TOMS 1, 71-96; Hindmarsh et al. (2005), ACM TOMS 31, 363-396.
//
//   predicted:  z = z P (Pascal's triangle);  corrected:  z_j + l_j e,  e = x_next - z_0
//   x_next - h/l_1 f(t, x_next) = z_0 - z_1/l_1
// Inside a step x(t + s h) = sum_j z_j s^j, the polynomial from which the next step is predicted.
class Bdf final : public Integrator {
 public:
  static constexpr int kMostOrder = 5;

  Bdf(const Tolerance& tolerance, const StageOptions& options)
      : tolerance_(tolerance), options_(options) {}

  IntegratorInfo info() const noexcept override {
    return {.order = kMostOrder, .adaptive = true, .implicit = true};
  }
  // Throws Error{kScene} for a system whose states may jump, as a multistep history needs
  // smoothness.
  void prepare(OdeSystem& system) override;
  Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override;
  void restart(double /*t*/, double /*h*/, const double* /*x*/) override { fresh_ = true; }
  std::vector<double> memory() const override;
  void recall(std::span<const double> memory) override;
  Effort effort() const override;
  std::vector<std::string> notes() const override { return solver_->notes(); }

 private:
  static constexpr std::size_t kArrays = kMostOrder + 1;
  using Coefficients = std::array<double, kMostOrder + 2>;

  // The scalars on which a step depends besides its arrays.
  struct History {
    double t = 0;              // of z, the end of the last step
    double h = 0, next_h = 0;  // of the last step, and of the next trial
    int order = 1, next_order = 1;
    int wait = 2;                                  // steps until another order is thought of
    double growth = 0;                             // of the next step, at most
    double saved_scale = 0;                        // of saved_; 0: there is none
    std::array<double, kMostOrder + 1> past = {};  // sizes of the last steps, the latest first
  };

  void begin(OdeSystem& system, double t, double h, const double* x);
  StepStatus next_step(OdeSystem& system);
  void set_coefficients(double h);
  void change_order(int order);
  void set_weights();
  void predict();
  void correct();
  void choose_next(double error);
  double norm(const Array& values) const;
  void interpolate(double t, double* out) const;

  Tolerance tolerance_;
  StageOptions options_;
  std::unique_ptr<StageSolver> solver_;
  bool fresh_ = true;
  History now_;
  std::array<Array, kArrays> z_, predicted_;
  Array saved_;  // the correction before the last one
  Array y_, r_, change_, weights_;

  // The coefficients of the trial step.
  Coefficients l_ = {};
  double tau_ = 0;                             // h / l_1
  double error_ = 0, lower_ = 0, higher_ = 0;  // errors of the orders beside over their measures
  double scale_ = 0;                           // of the derivative that e stands for
  Effort own_;
};

}  // namespace sim
