// Steps of a scene with PETSc.
#pragma once

#include <petscsnes.h>

#include "cli/petsc_scene.h"

namespace sim::petsc {

struct Block {
  double b[9];
};

// The unknowns of each stage of an implicit method are the velocities v with
//   g(v) = m (v - v0) - tau (F(q0 + tau v) - c v + m gravity) = 0,
// the equation of plugins/solvers/particles/stage_equation.h, and with it the slope of
//   phi(v) = m |v - v0|^2 / 2 - tau m gravity.v + tau c |v|^2 / 2 + U(q0 + tau v).
// Its derivative, m + tau c + tau^2 K, has symmetric blocks of 3 x 3: Newton's method (SNES) with
// conjugate gradients, each process preconditions its own block by an incomplete Cholesky
// factorisation. S. Balay et al., PETSc/TAO Users Manual, ANL-21/39.
class Stepper {
 public:
  explicit Stepper(Scene& scene) : scene_(scene) {}

  PetscErrorCode set_up();
  PetscErrorCode tear_down();
  // Takes one step; `good` is false if its equations have no solution in reach, or a number is not
  // finite.
  PetscErrorCode step(double tolerance, bool& good);
  PetscErrorCode write(int file, std::int64_t moment, std::int64_t step);

 private:
  static PetscErrorCode residual(SNES, Vec v, Vec g, void* self) {
    return static_cast<Stepper*>(self)->residual_at(v, g);
  }
  static PetscErrorCode objective(SNES, Vec v, PetscReal* phi, void* self) {
    return static_cast<Stepper*>(self)->phi_at(v, phi);
  }
  static PetscErrorCode jacobian(SNES, Vec v, Mat, Mat, void* self) {
    return static_cast<Stepper*>(self)->jacobian_at(v);
  }
  PetscErrorCode place(Vec v);  // places_ := q0 + reach v, with those of others
  PetscErrorCode residual_at(Vec v, Vec g);
  PetscErrorCode phi_at(Vec v, PetscReal* phi);
  PetscErrorCode jacobian_at(Vec v);
  PetscErrorCode fill(Mat matrix, const double* positions, bool clamped) const;
  PetscErrorCode accelerate(Vec q, Vec v, Vec a);
  PetscErrorCode solve(double tau, double tolerance, Vec v, bool& good);
  PetscErrorCode attempt(bool whole, double residual, int steps, Vec v);
  PetscErrorCode take_rk4();
  PetscErrorCode take_implicit(double tolerance, bool& good);
  double force_at(const double* positions, PetscInt i, double* force) const;
  Block stiffness(const double* positions, PetscInt i, std::size_t end, bool clamped) const;

  Scene& scene_;
  SNES snes_ = nullptr;
  // The derivative, and its positive part, which is factorised: with compressed springs the whole
  // may have no such factors.
  Mat matrix_ = nullptr, positive_ = nullptr;
  Vec places_ = nullptr;  // with ghosts
  Vec q_ = nullptr, v_ = nullptr, q0_ = nullptr, v0_ = nullptr;
  Vec g_ = nullptr, near_ = nullptr, w_ = nullptr;
  Vec k_[8] = {};               // velocities and accelerations of stages
  double tau_ = 0, reach_ = 0;  // reach: of places from q0
  bool clamped_ = false;
  double rounding_ = 0;  // of the residual
};

}  // namespace sim::petsc
