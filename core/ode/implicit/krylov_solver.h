// Implicit stages of any large system: products with the Jacobian alone.
#pragma once

#include <memory>
#include <vector>

#include "core/ode/implicit/stage_newton.h"

namespace sim {

// GMRES (Saad & Schultz (1986), SIAM J. Sci. Stat. Comput. 7, 856-869) on I - tau J, restarted
// after a number of products. A product is two evaluations of f, whatever the size; the number of
// products grows with tau times the fastest frequency. No matrix is stored.
class KrylovSolver final : public StageNewton {
 public:
  KrylovSolver(OdeSystem& system, const StageOptions& options);

 private:
  void linearise(double t, double tau, const double* y) override;
  bool divide(Array& x) override;

  double extend(int k);                  // adds a basis vector; returns the GMRES residual
  void add_to(Array& found, int count);  // found += the best of the basis

  double tau_ = 0;
  std::vector<Array> basis_;
  std::vector<double> h_, cosine_, sine_, rest_;  // R by columns; rotations; e_1 under them
  Array found_, right_;
};

}  // namespace sim
