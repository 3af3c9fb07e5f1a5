#include <algorithm>
#include <cmath>
#include <utility>

#include "cli/petsc_stepper.h"

namespace sim::petsc {

using engine::PetscHead;
using engine::PetscMethod;

PetscErrorCode Stepper::set_up() {
  const PetscInt own = scene_.own();
  PetscFunctionBeginUser;
  PetscCall(VecCreateGhostBlock(PETSC_COMM_WORLD, 3, 3 * own, PETSC_DECIDE,
                                static_cast<PetscInt>(scene_.ghosts.size()), scene_.ghosts.data(),
                                &places_));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, 3 * own, PETSC_DECIDE, &q_));
  PetscCall(VecSetBlockSize(q_, 3));
  for (Vec* each : {&v_, &q0_, &v0_, &g_, &near_, &w_}) PetscCall(VecDuplicate(q_, each));
  for (Vec& each : k_) PetscCall(VecDuplicate(q_, &each));
  double* values = nullptr;
  PetscCall(VecGetArray(q_, &values));
  std::ranges::copy(scene_.x, values);
  PetscCall(VecRestoreArray(q_, &values));
  PetscCall(VecGetArray(v_, &values));
  std::ranges::copy(scene_.v, values);
  PetscCall(VecRestoreArray(v_, &values));
  if (scene_.head.method == PetscMethod::kRk4) PetscFunctionReturn(0);

  // Blocks of a row: its own particle and the free ones joined by springs, local and remote.
  std::vector<PetscInt> here(static_cast<std::size_t>(own), 1), elsewhere(here.size(), 0);
  for (PetscInt i = 0; i < own; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (auto e = scene_.first[at]; e < scene_.first[at + 1]; ++e)
      ++(scene_.local[static_cast<std::size_t>(e)] < own ? here : elsewhere)[at];
  }
  // Parallel springs share one block.
  for (PetscInt& each : here) each = std::min(each, own);
  const auto others = static_cast<PetscInt>(scene_.head.n) - own;
  for (PetscInt& each : elsewhere) each = std::min(each, others);
  for (Mat* each : {&matrix_, &positive_}) {
    PetscCall(MatCreateBAIJ(PETSC_COMM_WORLD, 3, 3 * own, 3 * own, PETSC_DETERMINE, PETSC_DETERMINE,
                            0, here.data(), 0, elsewhere.data(), each));
    PetscCall(MatSetOption(*each, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(MatSetOption(*each, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  }

  PetscCall(SNESCreate(PETSC_COMM_WORLD, &snes_));
  PetscCall(SNESSetFunction(snes_, g_, residual, this));
  PetscCall(SNESSetObjective(snes_, objective, this));
  PetscCall(SNESSetJacobian(snes_, matrix_, positive_, jacobian, this));
  // PETSC_OPTIONS override these defaults.
  for (const auto& [name, value] : {std::pair{"-ksp_type", "cg"},
                                    {"-pc_type", "bjacobi"},
                                    {"-sub_pc_type", "icc"},
                                    {"-ksp_rtol", "1e-5"}}) {
    PetscBool said = PETSC_FALSE;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, name, &said));
    if (!said) PetscCall(PetscOptionsSetValue(nullptr, name, value));
  }
  PetscCall(SNESSetFromOptions(snes_));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::tear_down() {
  PetscFunctionBeginUser;
  PetscCall(SNESDestroy(&snes_));
  PetscCall(MatDestroy(&matrix_));
  PetscCall(MatDestroy(&positive_));
  for (Vec* each : {&places_, &q_, &v_, &q0_, &v0_, &g_, &near_, &w_}) PetscCall(VecDestroy(each));
  for (Vec& each : k_) PetscCall(VecDestroy(&each));
  PetscFunctionReturn(0);
}

namespace {

double length_of(const double* d) {
  const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  if (square > 1e-280 && square < 1e280) return std::sqrt(square);
  return std::hypot(d[0], d[1], d[2]);
}

}  // namespace

// The spring force at an own particle, N; returns half of the energy of its springs, J.
double Stepper::force_at(const double* positions, PetscInt i, double* force) const {
  const auto at = static_cast<std::size_t>(i);
  double energy = 0;
  force[0] = force[1] = force[2] = 0;
  for (auto e = static_cast<std::size_t>(scene_.first[at]);
       e < static_cast<std::size_t>(scene_.first[at + 1]); ++e) {
    const double* const other = positions + 3 * scene_.local[e];
    const double d[3] = {positions[3 * i] - other[0], positions[3 * i + 1] - other[1],
                         positions[3 * i + 2] - other[2]};
    const double length = length_of(d), longer = length - scene_.rest[e];
    energy += 0.25 * scene_.k[e] * longer * longer;
    if (length == 0) continue;
    const double s = -scene_.k[e] * (longer / length);
    for (int axis = 0; axis < 3; ++axis) force[axis] += s * d[axis];
  }
  return energy;
}

// -dF/dx of a spring: k (n n^T + (1 - rest / length) (I - n n^T)), n along it; for a compressed
// spring of the clamped matrix without the second part, which would not be positive.
Block Stepper::stiffness(const double* positions, PetscInt i, std::size_t e, bool clamped) const {
  const double* const other = positions + 3 * scene_.local[e];
  double d[3] = {positions[3 * i] - other[0], positions[3 * i + 1] - other[1],
                 positions[3 * i + 2] - other[2]};
  const double length = length_of(d), k = scene_.k[e];
  double across = length > 0 ? 1 - scene_.rest[e] / length : scene_.rest[e] == 0 ? 1 : 0;
  if (clamped) across = std::max(across, 0.0);
  for (double& each : d) each = length > 0 ? each / length : 0;
  Block block;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      block.b[3 * r + c] = k * ((r == c ? across : 0) + (1 - across) * d[r] * d[c]);
  return block;
}

PetscErrorCode Stepper::place(Vec v) {
  PetscFunctionBeginUser;
  const double *q0 = nullptr, *now = nullptr;
  double* positions = nullptr;
  PetscCall(VecGetArrayRead(q0_, &q0));
  PetscCall(VecGetArrayRead(v, &now));
  PetscCall(VecGetArray(places_, &positions));
  for (PetscInt i = 0; i < 3 * scene_.own(); ++i) positions[i] = q0[i] + reach_ * now[i];
  PetscCall(VecRestoreArray(places_, &positions));
  PetscCall(VecRestoreArrayRead(v, &now));
  PetscCall(VecRestoreArrayRead(q0_, &q0));
  PetscCall(VecGhostUpdateBegin(places_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGhostUpdateEnd(places_, INSERT_VALUES, SCATTER_FORWARD));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::residual_at(Vec v, Vec g) {
  PetscFunctionBeginUser;
  const PetscHead& head = scene_.head;
  PetscCall(place(v));
  Vec with_ghosts = nullptr;
  const double *positions = nullptr, *now = nullptr, *v0 = nullptr;
  double *out = nullptr, sums = 0;
  PetscCall(VecGhostGetLocalForm(places_, &with_ghosts));
  PetscCall(VecGetArrayRead(with_ghosts, &positions));
  PetscCall(VecGetArrayRead(v, &now));
  PetscCall(VecGetArrayRead(v0_, &v0));
  PetscCall(VecGetArray(g, &out));
  for (PetscInt i = 0; i < scene_.own(); ++i) {
    const double m = scene_.mass[static_cast<std::size_t>(i)];
    double force[3], stiff = 0;
    if (m > 0) force_at(positions, i, force);
    for (auto e = scene_.first[static_cast<std::size_t>(i)];
         e < scene_.first[static_cast<std::size_t>(i) + 1]; ++e)
      stiff += scene_.k[static_cast<std::size_t>(e)];
    for (PetscInt axis = 0; axis < 3; ++axis) {
      const PetscInt at = 3 * i + axis;
      if (!(m > 0)) {
        out[at] = 0;
        continue;
      }
      const double push = force[axis] - head.drag * now[at] + m * head.gravity[axis];
      out[at] = m * (now[at] - v0[at]) - tau_ * push;
      // Positions have rounding errors, which springs amplify by their stiffness.
      const double size =
          m * (std::fabs(now[at]) + std::fabs(v0[at])) +
          tau_ * (std::fabs(m * head.gravity[axis]) + stiff * std::fabs(positions[at]));
      sums += size * size;
    }
  }
  PetscCall(VecRestoreArray(g, &out));
  PetscCall(VecRestoreArrayRead(v0_, &v0));
  PetscCall(VecRestoreArrayRead(v, &now));
  PetscCall(VecRestoreArrayRead(with_ghosts, &positions));
  PetscCall(VecGhostRestoreLocalForm(places_, &with_ghosts));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &sums, 1, MPIU_REAL, MPIU_SUM, PETSC_COMM_WORLD));
  rounding_ = PETSC_MACHINE_EPSILON * std::sqrt(sums);
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::phi_at(Vec v, PetscReal* phi) {
  PetscFunctionBeginUser;
  const PetscHead& head = scene_.head;
  PetscCall(place(v));
  Vec with_ghosts = nullptr;
  const double *positions = nullptr, *now = nullptr, *v0 = nullptr;
  double sum = 0, force[3];
  PetscCall(VecGhostGetLocalForm(places_, &with_ghosts));
  PetscCall(VecGetArrayRead(with_ghosts, &positions));
  PetscCall(VecGetArrayRead(v, &now));
  PetscCall(VecGetArrayRead(v0_, &v0));
  for (PetscInt i = 0; i < scene_.own(); ++i) {
    const double m = scene_.mass[static_cast<std::size_t>(i)];
    sum += force_at(positions, i, force);
    for (PetscInt axis = 0; axis < 3; ++axis) {
      const PetscInt at = 3 * i + axis;
      const double change = now[at] - v0[at];
      sum += m * (0.5 * change * change - tau_ * head.gravity[axis] * now[at]) +
             (m > 0 ? 0.5 * tau_ * head.drag * now[at] * now[at] : 0);
    }
  }
  PetscCall(VecRestoreArrayRead(v0_, &v0));
  PetscCall(VecRestoreArrayRead(v, &now));
  PetscCall(VecRestoreArrayRead(with_ghosts, &positions));
  PetscCall(VecGhostRestoreLocalForm(places_, &with_ghosts));
  PetscCall(MPIU_Allreduce(&sum, phi, 1, MPIU_REAL, MPIU_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::jacobian_at(Vec v) {
  PetscFunctionBeginUser;
  PetscCall(place(v));
  Vec with_ghosts = nullptr;
  const double* positions = nullptr;
  PetscCall(VecGhostGetLocalForm(places_, &with_ghosts));
  PetscCall(VecGetArrayRead(with_ghosts, &positions));
  PetscCall(fill(matrix_, positions, clamped_));
  PetscCall(fill(positive_, positions, true));
  PetscCall(VecRestoreArrayRead(with_ghosts, &positions));
  PetscCall(VecGhostRestoreLocalForm(places_, &with_ghosts));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::fill(Mat matrix, const double* positions, bool clamped) const {
  PetscFunctionBeginUser;
  PetscCall(MatZeroEntries(matrix));
  const double square = tau_ * tau_;
  for (PetscInt i = 0; i < scene_.own(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const bool free = scene_.free(i);
    const double m = free ? scene_.mass[at] + tau_ * scene_.head.drag : 1;
    const PetscInt row = scene_.begin + i;
    Block own{{m, 0, 0, 0, m, 0, 0, 0, m}};
    for (auto e = static_cast<std::size_t>(scene_.first[at]);
         free && e < static_cast<std::size_t>(scene_.first[at + 1]); ++e) {
      Block block = stiffness(positions, i, e, clamped);
      for (int each = 0; each < 9; ++each) {
        own.b[each] += square * block.b[each];
        block.b[each] *= -square;
      }
      const auto column = static_cast<PetscInt>(scene_.other[e]);
      if (scene_.moves[e])
        PetscCall(MatSetValuesBlocked(matrix, 1, &row, 1, &column, block.b, ADD_VALUES));
    }
    PetscCall(MatSetValuesBlocked(matrix, 1, &row, 1, &row, own.b, ADD_VALUES));
  }
  PetscCall(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

}  // namespace sim::petsc
