// Long stages of backward Euler with constraints as additional equations.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/ode/ode_system.h"
#include "core/particles/constraints/constraints.h"
#include "core/particles/constraints/saddle_order.h"
#include "row_curvature.h"
#include "stage_equation.h"
#include "stage_matrix.h"

namespace sim {

// The stage  M (v - r_v) = tau F(t, q, v) + J(q)^T mu,  phi(t, q) = 0,  q = r_q + tau v,  for v and
// the impulses mu of the constraints: a differential-algebraic equation of index 3 (Hairer & Wanner
// (1996), section VII.1), whose long steps end in feasible states. Newton's method solves
//   [ A - tau sum mu d2phi   J^T ] [  dv ]   [ J^T mu - g ]
//   [ J                        0 ] [ -dmu ] = [ -phi / tau ]
// with A and g of StageMatrix and StageEquation, as L D L^T. A solution is accepted only if D has
// as many negative pivots as there are rows: A is then positive definite in the feasible
// directions, and the solution a minimum of the potential of the stage, no saddle (Gould (1985),
// Math. Program. 32, 90-99).
class ConstrainedStageSolver final : public StageSolver {
 public:
  // stopped(): polled between iterations, ends a solution with kStopped. Null if the pairs that
  // forces couple are not known, without which A cannot be assembled.
  static std::unique_ptr<ConstrainedStageSolver> make(Particles& system,
                                                      const Constraints& constraints,
                                                      std::size_t internal_begin,
                                                      std::function<bool()> stopped);

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  void restart() override;
  std::vector<double> memory() const override { return force_; }
  void recall(std::span<const double> memory) override;
  Effort effort() const override { return effort_; }

 private:
  ConstrainedStageSolver(Particles& system, const Constraints& constraints,
                         std::size_t internal_begin, std::vector<std::array<int, 2>> pairs,
                         std::function<bool()> stopped);
  void make_matrix();
  void assemble(bool definite);
  void add_constraints(bool definite);
  void add(int i, int j, const Mat3& block, double factor);
  double residual();
  bool improve();

  const Constraints* constraints_;
  std::size_t internal_begin_;
  StageEquation equation_;
  StageMatrix stage_;
  std::vector<std::array<int, 2>> pairs_;  // that forces couple
  SaddleOrder order_;
  int equations_ = 0;  // rows that act on free particles
  RowValues rows_;
  std::unique_ptr<SparseSymmetric> matrix_;
  RowCurvature curvature_;
  std::vector<double> rest_;
  std::vector<double> force_, mu_;  // N, of the constraints in the last stage; N s
  double* memory_ = nullptr;        // of the constraints
  bool minimum_ = false;  // the last matrix was positive definite along the allowed directions
  Effort effort_;
};

}  // namespace sim
