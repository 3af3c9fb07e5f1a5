#include "cli/petsc_stepper.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace sim::petsc {

using engine::PetscMethod;

// Newton's method from v to a residual, by whole steps with the exact derivative, or by steps with
// its positive part, shortened until phi falls enough.
PetscErrorCode Stepper::attempt(bool whole, double residual, int steps, Vec v) {
  PetscFunctionBeginUser;
  clamped_ = !whole;
  SNESLineSearch line = nullptr;
  PetscCall(SNESGetLineSearch(snes_, &line));
  PetscCall(SNESLineSearchSetType(line, whole ? SNESLINESEARCHBASIC : SNESLINESEARCHBT));
  constexpr double kStep = 1e-15;  // of the solution: smaller ones change nothing
  PetscCall(SNESSetTolerances(snes_, std::max(residual, rounding_), 0, kStep, steps, 100000));
  PetscCall(SNESSolve(snes_, nullptr, v));
  PetscFunctionReturn(0);
}

// tau and the knowns are set; v is a guess before and the solution after.
PetscErrorCode Stepper::solve(double tau, double tolerance, Vec v, bool& good) {
  PetscFunctionBeginUser;
  tau_ = reach_ = tau;
  const auto norm = [&](PetscReal& residual) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(residual_at(v, g_));
    PetscCall(VecNorm(g_, NORM_2, &residual));
    PetscFunctionReturn(0);
  };
  PetscReal first = 0, last = 0;
  PetscCall(VecCopy(v, near_));
  PetscCall(norm(first));
  good = first <= rounding_;
  // Whole steps are fast if they converge. Otherwise shortened ones approach the solution until
  // they do.
  constexpr int kRounds = 8, kWhole = 12, kShort = 500;
  constexpr double kNearer = 0.03;
  double near = first;
  for (int round = 0; round < kRounds && !good; ++round, near *= kNearer) {
    if (round > 0) {
      PetscCall(attempt(false, near, kShort, v));
      PetscCall(VecCopy(v, near_));
    }
    PetscCall(attempt(true, tolerance * first, kWhole, v));
    PetscCall(norm(last));
    good = last <= std::max(tolerance * first, rounding_);
    if (!good) PetscCall(VecCopy(near_, v));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::accelerate(Vec q, Vec v, Vec a) {
  PetscFunctionBeginUser;
  // g(v) = -m tau a for v0 = v and tau = 1, at the positions q0.
  tau_ = 1;
  reach_ = 0;
  PetscCall(VecCopy(v, v0_));
  PetscCall(VecCopy(q, q0_));
  PetscCall(residual_at(v, a));
  double* values = nullptr;
  PetscCall(VecGetArray(a, &values));
  for (PetscInt i = 0; i < scene_.own(); ++i)
    for (PetscInt axis = 0; axis < 3; ++axis) {
      const double m = scene_.mass[static_cast<std::size_t>(i)];
      values[3 * i + axis] = m > 0 ? -values[3 * i + axis] / m : 0;
    }
  PetscCall(VecRestoreArray(a, &values));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::take_rk4() {
  PetscFunctionBeginUser;
  const double h = scene_.head.h, parts[] = {0, h / 2, h / 2, h};
  Vec* const velocities = k_;
  Vec* const accelerations = k_ + 4;
  for (int stage = 0; stage < 4; ++stage) {
    Vec x = w_, v = velocities[stage];
    PetscCall(VecCopy(q_, x));
    PetscCall(VecCopy(v_, v));
    if (stage > 0) {
      PetscCall(VecAXPY(x, parts[stage], velocities[stage - 1]));
      PetscCall(VecAXPY(v, parts[stage], accelerations[stage - 1]));
    }
    PetscCall(accelerate(x, v, accelerations[stage]));
  }
  const PetscScalar weights[] = {h / 6, h / 3, h / 3, h / 6};
  PetscCall(VecMAXPY(q_, 4, weights, velocities));
  PetscCall(VecMAXPY(v_, 4, weights, accelerations));
  PetscFunctionReturn(0);
}

// The stages Y = x + tau sum of k + tau f(Y): in velocities V = v0 + tau a(Q, V), Q = q0 + tau V.
PetscErrorCode Stepper::take_implicit(double tolerance, bool& good) {
  PetscFunctionBeginUser;
  const double h = scene_.head.h;
  if (scene_.head.method != PetscMethod::kTrBdf2) {
    const bool midpoint = scene_.head.method == PetscMethod::kImplicitMidpoint;
    const double tau = midpoint ? h / 2 : h;
    PetscCall(VecCopy(q_, q0_));
    PetscCall(VecCopy(v_, v0_));
    PetscCall(VecCopy(v_, w_));
    PetscCall(solve(tau, tolerance, w_, good));
    if (!good) PetscFunctionReturn(0);
    // The end of the step, or the middle between both ends.
    PetscCall(VecAXPY(q_, midpoint ? 2 * tau : tau, w_));
    if (midpoint)
      PetscCall(VecAXPBY(v_, 2, -1, w_));
    else
      PetscCall(VecCopy(w_, v_));
    PetscFunctionReturn(0);
  }
  // The TR-BDF2 of plugins/integrators/implicit.cpp.
  const double root = std::sqrt(2.0), tau = (2 - root) / 2 * h, outer = root / 4 * h;
  Vec a1 = k_[0], v2 = k_[1], a2 = k_[2];
  PetscCall(accelerate(q_, v_, a1));
  PetscCall(VecWAXPY(q0_, tau, v_, q_));
  PetscCall(VecWAXPY(v0_, tau, a1, v_));
  PetscCall(VecCopy(v_, v2));
  PetscCall(solve(tau, tolerance, v2, good));
  if (!good) PetscFunctionReturn(0);
  PetscCall(VecWAXPY(a2, -1, v0_, v2));
  PetscCall(VecScale(a2, 1 / tau));
  PetscCall(VecWAXPY(q0_, outer, v_, q_));
  PetscCall(VecAXPY(q0_, outer, v2));
  PetscCall(VecWAXPY(v0_, outer, a1, v_));
  PetscCall(VecAXPY(v0_, outer, a2));
  PetscCall(VecCopy(v2, w_));
  PetscCall(solve(tau, tolerance, w_, good));
  if (!good) PetscFunctionReturn(0);
  PetscCall(VecWAXPY(q_, tau, w_, q0_));
  PetscCall(VecCopy(w_, v_));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::step(double tolerance, bool& good) {
  PetscFunctionBeginUser;
  good = true;
  if (scene_.head.method == PetscMethod::kRk4)
    PetscCall(take_rk4());
  else
    PetscCall(take_implicit(tolerance, good));
  PetscReal size[2] = {0, 0};
  PetscCall(VecNorm(q_, NORM_INFINITY, &size[0]));
  PetscCall(VecNorm(v_, NORM_INFINITY, &size[1]));
  good = good && std::isfinite(size[0]) && std::isfinite(size[1]);
  PetscFunctionReturn(0);
}

namespace {

bool put(int file, const void* bytes, std::size_t count, std::int64_t at) {
  for (std::size_t done = 0; done < count;) {
    const ssize_t written = ::pwrite(file, static_cast<const char*>(bytes) + done, count - done,
                                     static_cast<off_t>(at) + static_cast<off_t>(done));
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

}  // namespace

// Frame number `moment`; its step follows when all processes have written theirs.
PetscErrorCode Stepper::write(int file, std::int64_t moment, std::int64_t step) {
  PetscFunctionBeginUser;
  constexpr std::int64_t kRow = engine::kPetscColumns * 8;
  std::vector<double> rows(static_cast<std::size_t>(scene_.own()) * engine::kPetscColumns);
  const double *q = nullptr, *v = nullptr;
  PetscCall(VecGetArrayRead(q_, &q));
  PetscCall(VecGetArrayRead(v_, &v));
  for (PetscInt i = 0; i < scene_.own(); ++i)
    for (PetscInt axis = 0; axis < 3; ++axis) {
      rows[static_cast<std::size_t>(6 * i + axis)] = q[3 * i + axis];
      rows[static_cast<std::size_t>(6 * i + 3 + axis)] = v[3 * i + axis];
    }
  PetscCall(VecRestoreArrayRead(q_, &q));
  PetscCall(VecRestoreArrayRead(v_, &v));
  const std::int64_t frame = scene_.head.n * kRow, at = moment * (frame + 8);
  int good = put(file, rows.data(), rows.size() * 8, at + scene_.begin * kRow);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &good, 1, MPI_INT, MPI_MIN, PETSC_COMM_WORLD));
  PetscMPIInt rank = 0;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (good && rank == 0) good = put(file, &step, sizeof step, at + frame);
  PetscCheck(good, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "no space for frames");
  PetscFunctionReturn(0);
}

}  // namespace sim::petsc
