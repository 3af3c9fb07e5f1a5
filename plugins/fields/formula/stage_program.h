// Stages of explicit Runge-Kutta steps as lists of operations on numbers.
#pragma once

#include <array>
#include <functional>
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
// registers, scratch, h, weights times h.
class StageProgram {
 public:
  // Who multiplies the weights by h: set_step() where it seldom changes, or the code, in which a
  // product and its weight stand side by side.
  enum class Steps { kEqual, kChanging };

  // scratch: numbers for instructions of other kinds.
  StageProgram(const Code& code, int stages, Steps steps, int scratch = 0);

  // True if instructions can name all slots of such stages.
  static bool fits(const Code& code, int stages, int weights, int scratch = 0);

  int size() const { return size_; }
  int x() const { return 0; }
  int y() const { return y_; }
  int next() const { return next_; }
  int k(int stage) const { return k_ + stage * size_; }
  int scratch() const { return scratch_; }
  bool is_result(int slot) const { return slot >= next_ && slot < times_; }  // x_next or a slope

  // y := x + h sum_j weights_j k_j. Returns the first slot of the sum, x if nothing is added.
  int add_sum(std::span<const double> weights, int y) { return add_sum(weights, x(), y); }
  // y := h sum_j weights_j k_j; a weight at least is not 0.
  void add_slopes(std::span<const double> weights, int y) { add_sum(weights, kNothing, y); }
  // k_stage := f(t_stage, the numbers from slot `point` on).
  void add_slope(int stage, int point);
  void add_stage(std::span<const double> weights, int stage) {
    add_slope(stage, add_sum(weights, y_));
  }
  void add_copy(int from, int to);
  // `op` on `size` slots in a row; operands that do not move with them are `fixed`, by their bits.
  void add(Op op, int to, std::array<int, 3> operand, unsigned fixed = 0);
  // slots[to] := the largest of `size` slots from `from` on.
  void add_largest(int from, int to);

  // Takes all instructions added since the last call, as a list
  std::vector<Instruction> take() { return std::exchange(instructions_, {}); }
  // or as code, after which these slots are read.
  StraightCode take(const std::function<bool(int slot)>& live) {
    return StraightCode(take(), live);
  }

  double* slots() { return slots_.data(); }
  const double* slots() const { return slots_.data(); }
  std::span<const double> all_slots() const { return slots_; }
  int first_constant() const { return constants_; }
  int time(int stage) const { return times_ + stage; }
  std::size_t first_weight() const { return slots_.size() - weights_.size(); }
  void set_step(double h);
  bool reads_time() const { return code_.reads.back(); }
  void set_time(int stage, double t) { slots_[static_cast<std::size_t>(times_ + stage)] = t; }

 private:
  static constexpr int kNothing = -1;

  int add_sum(std::span<const double> weights, int from, int to);

  const Code& code_;
  Steps steps_;
  int size_, y_, next_, k_, times_, constants_, registers_, scratch_, h_;  // first slots
  std::vector<Instruction> instructions_;
  std::vector<double> weights_;  // of equal steps
  std::vector<double> slots_;
};

// Adds a whole step of equal steps: x := the next state.
void add_step(StageProgram& program, const ExplicitPlan& plan);

}  // namespace sim
