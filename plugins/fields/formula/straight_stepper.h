// Explicit Runge-Kutta steps of a few formulas as lists of operations on numbers.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "core/expression/straight_code.h"
#include "core/ode/ode_system.h"
#include "stage_program.h"

namespace sim {

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
  std::optional<ErrorNorms> error_norms(const Tolerance& tolerance) override;
  void shift() override;

 private:
  // Scratch: numbers of the norms, then for every number of the state its scale, then its ratio.
  enum Number { kAtol, kRtol, kFine, kCoarse, kNumbers };

  bool is_finite(int slot) const;  // all numbers of a state or slope from there on
  void set_times(double t, double h, int first, int last);
  void add_norms();
  int number(Number which) const { return program_.scratch() + which; }

  EmbeddedPlan plan_;
  StageProgram program_;
  StraightCode start_, step_, close_, extend_, norms_;
};

}  // namespace sim
