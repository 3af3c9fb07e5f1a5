// Explicit Runge-Kutta steps of a few formulas as one list of operations on numbers.
#pragma once

#include <vector>

#include "core/expression/program.h"
#include "core/ode/plan.h"

namespace sim {

// The stages of a step and the sums between them, in the order of OdeSystem's own stepper and so
// with its bits. `code` is f: its inputs are the numbers of the state and then t, its outputs their
// derivatives.
class StraightStepper final : public Stepper {
 public:
  StraightStepper(const Code& code, const ExplicitPlan& plan);

  // Whether instructions can name all slots of such a step.
  static bool fits(const Code& code, const ExplicitPlan& plan);

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  int at_once() const override { return at_once_; }

 private:
  void add_stage(const Code& code, int stage);
  // y := x + h sum_j weights_j k_j; y may be x. Returns the first slot of the sum.
  int add_sum(const double* weights, int count, int y);

  ExplicitPlan plan_;
  int size_, at_once_;
  int x_ = 0, y_, next_, k_, times_, constants_, registers_;  // first slots
  std::vector<Instruction> instructions_;
  struct Weight {
    int slot;
    double value;  // times h
  };
  std::vector<Weight> weights_;
  double h_ = 0;  // of the products in those slots
  std::vector<double> slots_;
  RunStraight run_ = run_straight();
};

}  // namespace sim
