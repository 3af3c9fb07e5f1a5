// The linear equations of a Newton step, A d = b.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/ode/ode_system.h"
#include "core/particles/implicit/multigrid.h"
#include "core/particles/implicit/sparse.h"
#include "core/particles/implicit/stage_matrix.h"

namespace sim {

struct LinearResult {
  bool definite = true;  // false: A is not positive definite, and d is of no use
  bool solved = true;    // to the accuracy asked for
  int iterations = 0;    // of an iterative solver
  int factorisations = 0;
  const double* downward = nullptr;  // p with p.A p <= 0 where one was found; until the next solve
};

class LinearSolver {
 public:
  virtual ~LinearSolver() = default;

  // d := A^-1 b, with |b - A d| <= eta |b| if it converges.
  virtual LinearResult solve(StageMatrix& matrix, const double* b, double* d, double eta) = 0;

  // Prepares a preconditioner, a fixed symmetric map z := about A^-1 r for the present A. False if
  // the solver has none.
  virtual bool prepare(const StageMatrix& /*matrix*/) { return false; }
  virtual void divide(const double* /*r*/, double* /*z*/) {}
  virtual bool divides_cheaply() const { return false; }  // unlike with a factor
};

// Conjugate gradients, preconditioned with the 3 x 3 blocks on the diagonal, in their norm.
// Hestenes & Stiefel (1952), J. Res. Nat. Bur. Standards 49, 409-436.
class ConjugateGradient final : public LinearSolver {
 public:
  ConjugateGradient(const Layout& layout, int most_iterations);
  // Adds a multigrid preconditioner, which is used if the blocks alone converge slowly.
  ConjugateGradient(const StageMatrix& matrix, const Particles& system, int most_iterations);
  LinearResult solve(StageMatrix& matrix, const double* b, double* d, double eta) override;
  bool prepare(const StageMatrix& matrix) override {
    return multilevel_ && multilevel_->prepare(matrix);
  }
  void divide(const double* r, double* z) override { multilevel_->solve(r, z); }
  bool divides_cheaply() const override { return multilevel_.has_value(); }

 private:
  int most_;
  Array r_, z_, p_, ap_;
  std::optional<Multigrid> multilevel_;
};

// Sparse L D L^T of the symmetric part of A, with the fill-reducing order of Amestoy, Davis & Duff
// (1996); the pattern is analysed once. Pinned particles have no rows.
class SparseLdlt final : public LinearSolver {
 public:
  // The pairs that springs and other forces couple, and their elimination_rows().
  SparseLdlt(const StageMatrix& matrix, ParticlePairs pairs, std::vector<int> rows);
  LinearResult solve(StageMatrix& matrix, const double* b, double* d, double eta) override;
  bool prepare(const StageMatrix& matrix) override;
  void divide(const double* r, double* z) override;

 private:
  struct Target {
    int column[3];  // index of the block's first value in each of three columns
  };
  Target target(int low, int high) const;
  void assemble(const StageMatrix& matrix);

  Layout layout_;
  std::vector<int> row_of_;  // of a particle, in threes; -1 where pinned
  std::optional<SparseSymmetric> upper_;
  std::vector<Target> diagonal_, springs_;  // of particles; of springs in the order of for_each
  std::vector<double> x_;
};

// For matrices that are not symmetric: GMRES(30), right-preconditioned with the 3 x 3 blocks on the
// diagonal, or with the factors of the symmetric part, if there are any and A is stiff. Saad &
// Schultz (1986), SIAM J. Sci. Stat. Comput. 7(3), 856-869.
class Gmres final : public LinearSolver {
 public:
  Gmres(const Layout& layout, int most_iterations, std::unique_ptr<SparseLdlt> factors,
        double stiff);
  LinearResult solve(StageMatrix& matrix, const double* b, double* d, double eta) override;

 private:
  static constexpr int kRestart = 30;
  void precondition(StageMatrix& matrix, const double* r);  // z_ := about A^-1 r

  int most_;
  std::unique_ptr<SparseLdlt> factors_;  // null: none
  double stiff_;                         // stiffness of A from which on they are used
  bool factored_ = false;
  std::vector<Array> basis_;
  Array r_, z_;
  double h_[kRestart][kRestart + 1];  // column by column, made triangular by rotations
};

// A solver that suits the system, or the one that the options require. `bounded`: inequalities may
// restrict the matrix. Throws Error{kScene} if that does not fit.
std::unique_ptr<LinearSolver> make_linear_solver(const StageMatrix& matrix, const Particles& system,
                                                 const StageOptions& options, bool bounded);

}  // namespace sim
