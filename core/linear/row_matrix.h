// The Schur complement of the Lagrange multipliers, A = J W J^T, and its factors.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/linear/row_pattern.h"
#include "core/math/vec3.h"

namespace sim {

// A is sparse: rows are coupled where they share a free node. The pattern is analysed once; a
// chain takes time linear in its links. A = L D L^T row by row (Davis (2006), Direct Methods for
// Sparse Linear Systems, section 4.7), in the given order or in one of little fill (Amestoy, Davis
// & Duff (1996)).
//
// A is singular if rows depend on others. Then A + e diag(A) is factorised, and solutions are
// refined by proximal steps, lambda += (A + e diag(A))^-1 (b - A lambda), which converge to the
// least-norm solution of A lambda = b, in the sense of least squares.
class RowMatrix {
 public:
  // weights: inverse masses of the nodes, 0 if one does not move.
  RowMatrix(const RowPattern& pattern, std::span<const double> weights);

  // shift: e, if rows are known to be nearly dependent; 0: if they are found to be.
  void factorise(std::span<const Vec3> gradient, std::span<const double> weights, double shift = 0);
  void solve(double* x);  // x := A^-1 x, in the order of the rows

  int dependent() const { return dependent_; }  // rows that follow from others, as it seems
  int first_dependent() const { return first_dependent_; }  // -1: none
  std::size_t fill() const { return rows_.size(); }         // numbers of L

 private:
  struct Product {  // w_i g_a . g_b, a part of one entry of A
    int a, b, node;
  };
  struct Place {
    int column, slot;
  };

  void analyse(const std::vector<std::vector<int>>& columns);
  bool eliminate(double shift);
  void substitute(double* x) const;
  void multiply(const double* x, double* out) const;

  int size_;
  std::vector<int> row_at_;  // the row that stands at each place of the order
  // Entries of A on and above the diagonal, column by column, the diagonal last.
  std::vector<int> entry_begin_, entry_row_, product_begin_;
  std::vector<Product> products_;
  std::vector<double> entries_;
  // L by columns without its diagonal; row k of it as the columns with an entry, ascending.
  std::vector<int> column_begin_, rows_, place_begin_;
  std::vector<Place> places_;
  std::vector<double> values_, inverse_, work_, x_, rest_, found_;
  std::vector<std::uint8_t> empty_;  // rows in which nothing moves
  int dependent_ = 0, first_dependent_ = -1;
  bool shifted_ = false;
};

}  // namespace sim
