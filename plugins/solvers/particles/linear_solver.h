// Solvers of linear equations A d = b, of a block matrix as it is at the time of the call.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "block_matrix.h"
#include "core/base/array.h"
#include "core/linear/sparse.h"

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
  virtual LinearResult solve(const double* b, double* d, double eta) = 0;

  // Prepares a preconditioner, a fixed symmetric map z := about A^-1 r for the present A. False if
  // the solver has none.
  virtual bool prepare() { return false; }
  virtual void divide(const double* /*r*/, double* /*z*/) {}
  virtual bool divides_cheaply() const { return false; }  // unlike with a factor
};

// A fixed symmetric map z := about A^-1 r.
class Preconditioner {
 public:
  virtual ~Preconditioner() = default;
  virtual bool prepare() = 0;  // for A as it is now; false when it cannot be used
  virtual double solve(const double* r, double* z) = 0;  // r.z
  virtual bool factorises() const { return false; }      // in prepare()
};

// Conjugate gradients, preconditioned with the 3 x 3 blocks on the diagonal, in their norm.
// Hestenes & Stiefel (1952), J. Res. Nat. Bur. Standards 49, 409-436.
class ConjugateGradient final : public LinearSolver {
 public:
  // better: used if the blocks alone converge slowly; null: none.
  ConjugateGradient(BlockMatrix& matrix, int most_iterations,
                    std::unique_ptr<Preconditioner> better = nullptr);
  LinearResult solve(const double* b, double* d, double eta) override;
  bool prepare() override { return better_ && better_->prepare(); }
  void divide(const double* r, double* z) override { better_->solve(r, z); }
  bool divides_cheaply() const override { return better_ != nullptr; }

 private:
  BlockMatrix* matrix_;
  int most_;
  Array r_, z_, p_, ap_;
  std::unique_ptr<Preconditioner> better_;
};

// Sparse L D L^T of the symmetric part of A, with the fill-reducing order of Amestoy, Davis & Duff
// (1996); the pattern is analysed once.
class SparseLdlt final : public LinearSolver, public Preconditioner {
 public:
  // All pairs that blocks may couple, and their elimination_rows().
  SparseLdlt(const BlockMatrix& matrix, BlockPairs pairs, std::vector<int> rows);
  LinearResult solve(const double* b, double* d, double eta) override;
  bool prepare() override;
  void divide(const double* r, double* z) override;
  double solve(const double* r, double* z) override;
  bool factorises() const override { return true; }

 private:
  struct Target {
    int column[3];  // index of the block's first value in each of three columns
  };
  Target target(int low, int high) const;
  void assemble();

  const BlockMatrix* matrix_;
  std::vector<int> row_of_;  // of a node, in threes; -1: it has none
  std::optional<SparseSymmetric> upper_;
  std::vector<Target> diagonal_, fixed_;  // of nodes; of fixed pairs
  std::vector<double> x_;
};

// GMRES(30), also for matrices that are not symmetric, right-preconditioned with the 3 x 3 blocks
// on the diagonal, or better where A is stiff. Saad & Schultz (1986), SIAM J. Sci. Stat. Comput.
// 7(3), 856-869. `symmetric`: A is, and conjugate gradients go on where 30 vectors do not reach.
class Gmres final : public LinearSolver {
 public:
  // better: used where A is at least so stiff; null: none.
  Gmres(BlockMatrix& matrix, int most_iterations, std::unique_ptr<Preconditioner> better,
        double stiff, bool symmetric = false);
  LinearResult solve(const double* b, double* d, double eta) override;

 private:
  static constexpr int kRestart = 30;
  void precondition(const double* r);  // z_ := about A^-1 r
  int descend(double* d, double goal, int most);

  BlockMatrix* matrix_;
  int most_;
  bool symmetric_;
  std::unique_ptr<Preconditioner> better_;  // null: none
  double stiff_;                            // stiffness of A from which on it is used
  bool prepared_ = false;
  std::vector<Array> basis_;
  Array r_, z_;
  double h_[kRestart][kRestart + 1];  // column by column, made triangular by rotations
};

}  // namespace sim
