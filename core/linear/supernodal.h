// Factors L D L^T of sparse symmetric matrices, in dense panels.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/math/sparsity.h"

namespace sim {

// Dense operations on columns of numbers, each `stride` from the next. Rows may be read up to seven
// further, and products and sums written so. Each sum has an order of its own, whatever the vectors
// of the machine.
struct PanelKernels {
  // c[i + 4th stride j] := sum_k a[i + stride k] b[4 k + j] for i < rows, j < 4.
  void (*multiply)(const double* a, std::ptrdiff_t stride, int rows, const double* b, int depth,
                   double* c, std::ptrdiff_t c_stride);
  // Eliminates up to four columns of a panel whose first row is the diagonal, as L D L^T; false if
  // a pivot is 0 or not finite, or below 0 where they must be positive.
  bool (*eliminate)(double* panel, std::ptrdiff_t stride, int rows, int columns, bool positive,
                    double* pivots);
  // x := L^-1 x and x := L^-T x for the columns of a panel; x has 8 numbers more than rows, 0.
  void (*forward)(const double* panel, std::ptrdiff_t stride, int rows, int columns, double* x);
  void (*backward)(const double* panel, std::ptrdiff_t stride, int rows, int columns, double* x);
};
PanelKernels panel_kernels();

// The numbers of entries of L below the diagonals, of the upper half of a matrix.
std::vector<int> factor_counts(const Sparsity& upper);

// Columns of L with nearly the same rows are kept as one dense panel (supernodes; Ng & Peyton 1993,
// SIAM J. Sci. Comput. 14). A panel takes the products of those before it that reach its columns,
// then its columns are eliminated (as in CHOLMOD; Chen, Davis, Hager & Rajamanickam 2008, ACM
// Trans. Math. Softw. 35(3)). Rows keep the given order but for a postorder of the elimination
// tree.
class SupernodalFactors {
 public:
  SupernodalFactors() = default;
  // The upper half with its diagonal.
  explicit SupernodalFactors(const Sparsity& upper);

  // Factorises the matrix of these entries, whose diagonal is larger by a share `shift`; false if a
  // pivot is 0 or not finite, or below 0 where they must be positive. Allocates nothing.
  bool factorise(std::span<const double> values, bool positive, double shift = 0);
  double pivot(int row) const {
    return pivots_[static_cast<std::size_t>(order_[static_cast<std::size_t>(row)])];
  }
  int negative_pivots() const;
  // x := A^-1 x, in one thread at a time.
  void solve(std::span<double> x) const;

 private:
  struct Panel {
    int first, columns;  // of L
    std::size_t rows;    // the first of its rows in rows_, those of its columns before the others
    int count;           // of rows
    std::size_t place;   // in numbers_, column by column
  };

  std::vector<int> supernodes(std::span<const int> parents, std::span<const int> counts) const;
  void find_rows(std::span<const int> first, const Sparsity& upper);
  void place_entries(const Sparsity& upper);
  void update(const Panel& to, const Panel& from, int begin, int end);
  bool eliminate(const Panel& panel, bool positive);
  void multiply(const double* l, std::ptrdiff_t stride, const double* pivots, int depth, int rows,
                int columns);
  double* columns_of(const Panel& panel) { return numbers_.data() + panel.place; }
  const double* columns_of(const Panel& panel) const { return numbers_.data() + panel.place; }

  PanelKernels kernels_ = panel_kernels();
  std::vector<int> order_;  // the place of each row among those of L
  std::vector<Panel> panels_;
  std::vector<int> rows_, panel_of_;  // of a column
  std::vector<std::size_t> entries_;  // their places in numbers_
  Array numbers_, pivots_;

  // Work space. Panels that still reach columns of others wait in lists of the next they reach.
  std::vector<int> waiting_, next_, reached_, local_, relative_;
  Array factor_, product_;
  mutable Array all_, some_;
};

}  // namespace sim
