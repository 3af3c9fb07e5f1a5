// Pressures that keep the rows of a fluid, none of them negative.
#pragma once

#include <span>

#include "core/base/array.h"
#include "density_constraints.h"
#include "ordered_sums.h"

namespace sim {

// p >= 0,  A p >= b,  p (A p - b) = 0,  A = J M^-1 J': the p >= 0 of the least 1/2 p A p - b p, by
// conjugate gradients on those above 0, with steps that let go or take up others (Dostal & Schoberl
// (2005), Comput. Optim. Appl. 30, 23-43: MPRGP). Sums are taken by ids, so that bits do not depend
// on where neighbour lists have put the particles.
class PressureSolve {
 public:
  // `largest`: eigenvalue of J J' (1/m^2), about. n: particles.
  void bind(int n, double largest) { n_ = n, largest_ = largest, sum_ = OrderedSums(n); }

  // The pressures of all places; solve() starts from them (warm start), none of them negative.
  std::span<double> pressures(const DensityConstraints& rows);
  // Until the root of the mean square of what is missing is at most `tolerance`, in units of b.
  // False where it was not reached; pushes() are of the pressures found all the same. Masses in kg,
  // infinite where a particle is held.
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
