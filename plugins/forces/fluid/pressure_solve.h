// Non-negative pressures that satisfy the density constraints of a fluid.
#pragma once

#include <span>

#include "core/base/array.h"
#include "density_constraints.h"
#include "ordered_sums.h"

namespace sim {

// p >= 0,  A p >= b,  p (A p - b) = 0,  A = J M^-1 J': the p >= 0 of least 1/2 p A p - b p, by
// conjugate gradients on the positive pressures, with steps that release or add others (Dostal &
// Schoberl (2005), Comput. Optim. Appl. 30, 23-43: MPRGP). Sums are taken by ids, so that bits do
// not depend on the places in neighbour lists.
class PressureSolve {
 public:
  // `largest`: approximate largest eigenvalue of J J' (1/m^2). n: particles.
  void bind(int n, double largest) { n_ = n, largest_ = largest, sum_ = OrderedSums(n); }

  // The pressures of all places; solve() starts from them (warm start), none of them negative.
  std::span<double> pressures(const DensityConstraints& rows);
  // Iterates until the root mean square of the residual is at most `tolerance`, in units of b.
  // False if it was not reached; the forces are those of the pressures found all the same. Masses
  // in kg, infinite for a fixed particle.
  bool solve(const DensityConstraints& rows, const double* b, const double* mass, double tolerance,
             ThreadPool& pool);

  const double* pressure_forces() const {
    return pushes_.data();
  }                                            // -M^-1 J' p, four numbers a place
  long products() const { return products_; }  // with A, so far

 private:
  void push(const DensityConstraints& rows, const double* p, ThreadPool& pool);
  void multiply(const DensityConstraints& rows, const double* p, double* result, ThreadPool& pool);
  template <class Act>
  void each(ThreadPool& pool, const Act& act);

  int n_ = 0, places_ = 0;
  double largest_ = 0;
  long products_ = 0;
  Array p_, gradient_, way_, product_, pushes_, inverse_;
  OrderedSums sum_;
};

}  // namespace sim
