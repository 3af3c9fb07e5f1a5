// Drifts of constrained particles whose forces are too stiff for SHAKE.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "core/linear/sparse.h"
#include "core/particles/constraints/constraints.h"
#include "core/particles/constraints/row_values.h"
#include "core/particles/constraints/saddle_order.h"

namespace sim {

// SHAKE is explicit in the directions of the constraint forces. So a taut chain of rods has a limit
// of stability, h < l sqrt(m / (T l)) with the length l and mass m of a link and the tension T,
// like the limit of Courant, Friedrichs & Lewy (1928) for a string. These drifts have none. They
// take the directions at the middle of the drift (Gonzalez (1999), Physica D 132, 165-174):
//   M (u - d v0) = J(q0 + u/2)^T lambda,  phi(t + d, q0 + u) = 0,  q := q0 + u,  v := 2 u / d - v0,
// of second order; if phi is quadratic and independent of time, no work is done. Newton's method
// solves for u and lambda together, with curvature() of the constraints:
//   [ M - sum lambda d2phi/2   J^T ]
//   [ J                          0 ]
// as L D L^T in the order of saddle_order().
class ImplicitDrift {
 public:
  using Axes = Constraints::Axes;

  explicit ImplicitDrift(const Constraints& constraints);

  // v: obeys J v + drive = 0 at t, and has to be projected at the end. False, with q and v
  // unchanged, if Newton's method does not converge.
  bool move(double t, double d, const ParticleView& like, const Axes& q, const Axes& v,
            const double* memory);

 private:
  struct Pair {  // of particles of a row
    int row, a, b;
    std::array<int, 3> entry;  // of the matrix, one an axis; -1 where a or b is pinned
  };

  void make_matrix();
  bool evaluate(double t, ParticleView like, const Axes& q, const double* memory, double share,
                RowValues& values);
  double residual(double d, const Axes& v);  // into rest_; m
  bool turns_too_far() const;
  bool improve();  // one step of Newton's method

  const Constraints* constraints_;
  RowValues middle_, end_;
  SaddleOrder order_;
  std::vector<Pair> pairs_;
  std::vector<std::array<int, 3>> mass_entry_, gradient_entry_;  // of particles, of parts of rows
  std::vector<int> row_entry_;
  std::unique_ptr<SparseSymmetric> matrix_;
  std::vector<double> curvature_, lambda_, rest_;
  std::vector<double> u_, trial_;  // m, axis by axis
};

// The largest sum |mu| sum |c| / m of a particle, 1/s: a bound on the change of velocities by
// displacements under impulses mu of constraints. curvature() of all constraints at a state.
class CurvatureBound {
 public:
  explicit CurvatureBound(const Constraints& constraints);

  double of(const ParticleView& view, const double* memory, std::span<const double> impulses);

 private:
  const Constraints* constraints_;
  std::vector<double> curvature_, sums_;
};

}  // namespace sim
