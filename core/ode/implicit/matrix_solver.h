// Linear equations with I - tau J, whose entries stand where they stand.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "core/math/sparsity.h"

namespace sim {

class MatrixSolver {
 public:
  virtual ~MatrixSolver() = default;

  // J by its entries, in the order of the sparsity. False where the matrix is singular, or a number
  // of it is not finite.
  virtual bool factorise(double tau, std::span<const double> values) = 0;

  // x := (I - tau J)^-1 x. After a factorisation.
  virtual void solve(double* x) = 0;

  virtual std::string name() const = 0;  // "band 2 + 2", "sparse", "dense", "200 blocks"
};

// The kind with the least operations: dense blocks where the unknowns fall into groups, a band in
// the order of the state or of Cuthill & McKee (1969), or a sparse factorisation (Eigen, columns by
// COLAMD).
std::unique_ptr<MatrixSolver> make_matrix_solver(const Sparsity& sparsity);

}  // namespace sim
