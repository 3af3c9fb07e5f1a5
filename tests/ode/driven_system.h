// Numbers that grow or decay, each driven by a wave: implicit stages of such a system have closed
// forms.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/ode/ode_system.h"

namespace sim_test {

// y_i' = rate_i y_i + cos(t + i) + tanh(40 (t - 1)), steep at t = 1 so that steps are rejected.
class DrivenSystem final : public sim::OdeSystem {
 public:
  explicit DrivenSystem(std::vector<double> rates) : rates_(std::move(rates)) {}

  std::size_t size() const noexcept override { return rates_.size(); }
  double drive(double t, std::size_t i) const {
    return t > ends ? std::nan("") : std::cos(t + static_cast<double>(i)) + std::tanh(40 * (t - 1));
  }
  double slope(double t, double y, std::size_t i) const { return rates_[i] * y + drive(t, i); }
  // The solution of y - tau f(t, y) = r.
  double solution(double t, double tau, double r, std::size_t i) const {
    return (r + tau * drive(t, i)) / (1 - tau * rates_[i]);
  }

  void eval(double t, const sim::Stage& stage, double* y, double* dydt) override {
    ++evaluations;
    combine(stage, y);
    for (std::size_t i = 0; i < size(); ++i) dydt[i] = slope(t, y[i], i);
  }
  void combine(const sim::Stage& stage, double* out) override {
    for (std::size_t i = 0; i < size(); ++i) {
      double sum = stage.x[i];
      for (const auto& term : stage.terms) sum += term.coef * term.k[i];
      out[i] = sum;
    }
  }
  std::unique_ptr<sim::StageSolver> stage_solver(const sim::StageOptions& /*options*/) override {
    return std::make_unique<Solver>(*this);
  }

  std::int64_t evaluations = 0;
  double ends = HUGE_VAL;  // s, after which f is not a number
  int failures = 0;        // of the equations to come
  bool records = false;    // guesses of solutions
  std::vector<std::vector<double>> guesses;

 private:
  class Solver final : public sim::StageSolver {
   public:
    explicit Solver(DrivenSystem& system) : system_(&system) {}
    sim::StepStatus solve(double t, double tau, const double* r, double* y) override {
      ++solved_;
      if (system_->records) system_->guesses.emplace_back(y, y + system_->size());
      if (system_->failures > 0) {
        --system_->failures;
        return sim::StepStatus::kNotConverged;
      }
      for (std::size_t i = 0; i < system_->size(); ++i) y[i] = system_->solution(t, tau, r[i], i);
      return sim::StepStatus::kDone;
    }
    void restart() override { solved_ = 0; }
    std::vector<double> memory() const override { return {static_cast<double>(solved_)}; }
    void recall(std::span<const double> memory) override {
      solved_ = memory.size() == 1 ? static_cast<std::int64_t>(memory[0]) : -1;
    }
    sim::Effort effort() const override { return {.newton = solved_}; }

   private:
    DrivenSystem* system_;
    std::int64_t solved_ = 0;
  };

  std::vector<double> rates_;
};

}  // namespace sim_test
