// The stages of an embedded pair on particles.
#pragma once

#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/explicit/rk_stepper.h"
#include "core/particles/particles.h"

namespace sim {

// Only a_i of k_i = (v_i, a_i) is kept, see RkStepper, which takes the step; any combination of the
// stages is one of accelerations:
//   sum_i w_i v_i = (sum_i w_i) v + h sum_j (sum_i w_i a_ij) a_j
class EmbeddedRkStepper final : public EmbeddedStepper {
 public:
  EmbeddedRkStepper(Particles& system, const EmbeddedPlan& plan);

  bool start(double t, const double* x) override { return evaluate(t, x, 0); }
  bool step(double t, double h, const double* x, double* x_next) override {
    return stepper_.step(t, h, 1, x, x_next);
  }
  bool close(double t, const double* x) override { return evaluate(t, x, plan_.stages); }
  void extend(double t, double h, const double* x) override;
  void combine(const double* x, double h, std::span<const double> weights, const double* base,
               double* out) override;
  void shift() override;

 private:
  bool evaluate(double t, const double* x, int i);

  Particles* system_;
  EmbeddedPlan plan_;
  CombineRange combine_range_ = combine_range();
  std::vector<Array> a_;
  RkStepper<double> stepper_;
  Array y_;  // the state of a stage of dense output
  std::vector<double> of_acceleration_;
  std::vector<Stage::Term> q_terms_, v_terms_;
};

}  // namespace sim
