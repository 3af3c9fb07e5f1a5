// Runs of formulas that differ in numbers alone, stepped side by side in the lanes of vectors.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/expression/program.h"
#include "core/ode/ode_system.h"
#include "straight_stepper.h"

namespace sim {

// True if two lists of instructions differ in constants alone.
bool same_operations(const Code& a, const Code& b);

// The runs request their steps one after the other, each for all of its own. The first that reaches
// a batch of so many steps has it made for all, and its end is stored for the others: each lane has
// the bits of a run by itself, since lanes of a vector are independent. A run makes the steps
// inside a batch by itself, and all that follow once its state was changed.
class Ensemble {
 public:
  // Each outlives the ensemble. All have the same operations.
  struct Lane {
    const Code* code;
    std::span<const double> start;  // the state at the start
  };
  Ensemble(std::vector<Lane> lanes, double h);

  // The steps made so far, up to `count` of size h from x at t; x_next is the state after them. The
  // run makes the others and reports their total number and its position then. Empty if the run has
  // left its way from its start in steps of the size of all.
  std::optional<int> advance(std::size_t lane, const ExplicitPlan& plan, double t, double h,
                             int count, const double* x, double* x_next);
  void arrive(std::size_t lane, int steps, const double* x);

 private:
  static constexpr std::size_t kMostNumbers = std::size_t{1} << 23;  // that are kept, 64 MB

  // The end of a batch: the numbers of all lanes, slot by slot.
  struct Leg {
    double t;  // of its start
    std::vector<double> to;
  };
  struct Position {
    std::int64_t steps = 0;
    std::vector<double> x;
  };

  bool prepare(const ExplicitPlan& plan);
  void add_leg(double t, double h, const ExplicitPlan& plan);

  std::vector<Lane> lanes_;
  std::size_t size_ = 0;   // numbers of a state
  std::size_t width_ = 0;  // lanes, a multiple of 8
  bool able_ = true;
  std::optional<StageProgram> program_;
  std::vector<Instruction> instructions_;
  std::vector<double> numbers_;  // of all slots
  std::vector<double*> slots_;
  RunInstructions run_ = run_instructions();

  int leg_steps_ = 1;
  double h_;
  std::vector<double> start_;  // of all lanes
  std::vector<Leg> legs_;
  // Each lane is at a position; the one before its last steps is kept for runs that estimate the
  // error of a step and repeat it.
  std::vector<Position> positions_, before_;
};

}  // namespace sim
