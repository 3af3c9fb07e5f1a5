// Explicit Runge-Kutta steps of a few formulas as lists of operations on numbers.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/expression/program.h"
#include "core/expression/straight_code.h"
#include "core/ode/ode_system.h"

namespace sim {

// Writes stages and the sums between them as instructions, in the order of OdeSystem's own steppers
// and so with their bits. `code` is f: its inputs are the numbers of the state and then t, its
// outputs their derivatives. Slots: x, y, x_next, k of each stage, t of each stage, constants,
// registers, weights times h.
class StageProgram {
 public:
  StageProgram(const Code& code, int stages);

  // True if instructions can name all slots of such stages.
  static bool fits(const Code& code, int stages, int weights);

  int size() const { return size_; }
  int x() const { return 0; }
  int next() const { return next_; }
  int k(int stage) const { return k_ + stage * size_; }
  bool is_result(int slot) const { return slot >= next_ && slot < times_; }  // x_next or a slope

  // y := x + h sum_j weights_j k_j. Returns the first slot of the sum, x if nothing is added.
  int add_sum(std::span<const double> weights, int y);
  // k_stage := f(t_stage, the numbers from slot `point` on).
  void add_slope(int stage, int point);
  void add_stage(std::span<const double> weights, int stage) {
    add_slope(stage, add_sum(weights, y_));
  }
  void add_copy(int from, int to);

  // Takes all instructions added since the last call, as a list
  std::vector<Instruction> take() { return std::exchange(instructions_, {}); }
  // or as code, after which these slots are read.
  StraightCode take(const std::function<bool(int slot)>& live) {
    return StraightCode(take(), live);
  }

  double* slots() { return slots_.data(); }
  std::span<const double> all_slots() const { return slots_; }
  int first_constant() const { return constants_; }
  int time(int stage) const { return times_ + stage; }
  std::size_t first_weight() const { return slots_.size() - weights_.size(); }
  void set_step(double h);
  bool reads_time() const { return code_.reads.back(); }
  void set_time(int stage, double t) { slots_[static_cast<std::size_t>(times_ + stage)] = t; }

 private:
  const Code& code_;
  int size_, y_, next_, k_, times_, constants_, registers_;  // first slots
  std::vector<Instruction> instructions_;
  std::vector<double> weights_;
  double h_ = 0;  // of the products with them in the last slots
  std::vector<double> slots_;
};

// Adds a whole step of equal steps: x := the next state.
void add_step(StageProgram& program, const ExplicitPlan& plan);

class Ensemble;

// A lane of an ensemble; null: no lane.
struct EnsembleLane {
  std::shared_ptr<Ensemble> ensemble;
  std::size_t lane = 0;
};

// Steps of equal size.
class StraightStepper final : public Stepper {
 public:
  // `beside`: the lane that the field assigns, if it runs in an ensemble.
  StraightStepper(const Code& code, const ExplicitPlan& plan, const EnsembleLane& beside);

  static bool fits(const Code& code, const ExplicitPlan& plan);

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  int at_once() const override { return at_once_; }

 private:
  ExplicitPlan plan_;
  const EnsembleLane& beside_;
  StageProgram program_;
  int at_once_;
  StraightCode code_;
};

// The stages of an embedded pair.
class StraightPair final : public EmbeddedStepper {
 public:
  StraightPair(const Code& code, const EmbeddedPlan& plan);

  static bool fits(const Code& code, const EmbeddedPlan& plan);

  bool start(double t, const double* x) override;
  bool step(double t, double h, const double* x, double* x_next) override;
  bool close(double t, const double* x) override;
  void extend(double t, double h, const double* x) override;
  void combine(const double* x, double h, std::span<const double> weights, const double* base,
               double* out) override;
  void shift() override;

 private:
  bool slope_is_finite(int stage);
  void set_times(double t, double h, int first, int last);

  EmbeddedPlan plan_;
  StageProgram program_;
  StraightCode start_, step_, close_, extend_;
};

}  // namespace sim
