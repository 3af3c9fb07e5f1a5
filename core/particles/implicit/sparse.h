// Sparse factorisation by Eigen, without its copies.
#pragma once

#include <Eigen/SparseCholesky>
#include <span>
#include <utility>
#include <vector>

namespace sim {

// L D L^T of a symmetric matrix of which the upper half is given, in the order it has. After the
// first factorisation none takes memory (above 16000 rows Eigen takes some for its own use).
class InPlaceLdlt : public Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper,
                                                 Eigen::NaturalOrdering<int>> {
 public:
  // False when the matrix is not positive definite.
  bool factorise(const Eigen::SparseMatrix<double>& upper) {
    factorize_preordered<true>(upper);
    return info() == Eigen::Success && m_diag.minCoeff() > 0;
  }
  void solve_in_place(Eigen::VectorXd& x) const {
    matrixL().solveInPlace(x);
    x.array() /= m_diag.array();
    matrixU().solveInPlace(x);
  }
};

// For each particle its row in an order of little fill, -1 where pinned (of infinite mass). Pairs
// are the entries off the diagonal. Amestoy, Davis & Duff (1996), SIAM J. Matrix Anal. Appl. 17(4).
std::vector<int> elimination_rows(std::span<const double> masses,
                                  std::span<const std::pair<int, int>> pairs);

}  // namespace sim
