// Linear solvers for I - tau J with a fixed sparsity pattern.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "core/math/sparsity.h"

namespace sim {

class MatrixSolver {
 public:
  virtual ~MatrixSolver() = default;

  // Factorises I - tau J, with the entries of J in the order of the sparsity. False if the matrix
  // is singular, or a number of it is not finite.
  virtual bool factorise(double tau, std::span<const double> values) = 0;

  // x := (I - tau J)^-1 x. After a factorisation.
  virtual void solve(double* x) = 0;

  virtual std::string name() const = 0;  // "band 2 + 2", "sparse", "dense", "200 blocks"
};

// Chooses the solver with the least operations: dense blocks if the unknowns fall into groups, a
// band in the order of the state or of Cuthill & McKee (1969), or a sparse factorisation (Eigen,
// columns by COLAMD).
std::unique_ptr<MatrixSolver> make_matrix_solver(const Sparsity& sparsity);

}  // namespace sim
