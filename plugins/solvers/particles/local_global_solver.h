// Implicit stages of springs by projective dynamics.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/linear/sparse.h"
#include "core/ode/ode_system.h"
#include "core/particles/particles.h"
#include "stage_equation.h"

namespace sim {

// Liu, Bargteil, O'Brien & Kavan (2013), ACM TOG 32(6) 214. Local: each spring finds the vector of
// its rest length nearest to d, p = r d/|d|. Global: with these p the potential of the stage is
// quadratic; its minimum is found with the constant matrix A = M + tau c + tau^2 L, L = sum k over
// the springs as a graph, the same for all three coordinates and factorised once for each tau.
// Since grad U = L q - sum k p, an iteration is  v := v - A^-1 g(v)  with the gradient g of the
// stage (Liu, Bouaziz & Kavan 2017, ACM TOG 36(3)): it converges to what Newton's method finds.
class LocalGlobalSolver final : public StageSolver {
 public:
  // Throws Error{kScene} for forces that are neither springs nor affine.
  LocalGlobalSolver(Particles& system, const StageOptions& options,
                    std::function<bool()> stopped = {});

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  Effort effort() const override;

 private:
  void factorise(double tau);
  double norm() const;  // of the gradient, |g|^2 = sum g_i^2 / A_ii

  struct Spring {
    int entry, low, high;  // of the value of A off the diagonal; rows of both ends
    double k;
  };
  Particles* system_;
  std::function<bool()> stopped_;
  int iterations_;
  StageEquation equation_;
  std::vector<int> row_of_;        // of a particle, -1 where pinned
  std::vector<int> diagonal_;      // entries of the values of A
  std::vector<double> stiffness_;  // L_ii of each row
  std::vector<Spring> springs_;    // between free particles
  std::optional<SparseSymmetric> upper_;
  std::vector<double> x_;
  double tau_ = 0;  // of the factors
  Effort effort_;
};

}  // namespace sim
