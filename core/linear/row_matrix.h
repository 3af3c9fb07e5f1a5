// The Schur complement of the Lagrange multipliers, A = J W J^T, and its factors.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/thread_pool.h"
#include "core/linear/row_pattern.h"
#include "core/math/vec3.h"

namespace sim {

// A is sparse: rows are coupled where they share a free node. The pattern is analysed once; a
// chain takes time linear in its links. A = L D L^T row by row (Davis (2006), Direct Methods for
// Sparse Linear Systems, section 4.7), in the given order or in one of little fill (Amestoy, Davis
// & Duff (1996)).
//
// Rows that share no node with others, not even through further rows, are components, each with
// factors of its own: on several threads, with the same bits.
//
// A is singular if rows depend on others. Then A + e diag(A) is factorised, and solutions are
// refined by proximal steps, lambda += (A + e diag(A))^-1 (b - A lambda), which converge to the
// least-norm solution of A lambda = b, in the sense of least squares.
class RowMatrix {
 public:
  // weights: inverse masses of the nodes, 0 if one does not move. orthogonal: of each row, true if
  // its gradient is orthogonal to those of such rows that it shares nodes with; empty: none.
  RowMatrix(const RowPattern& pattern, std::span<const double> weights,
            std::span<const std::uint8_t> orthogonal = {});

  void share(ThreadPool* pool) { pool_ = pool; }  // between its threads; null: the caller alone

  // shift: e, if rows are known to be nearly dependent; 0: if they are found to be.
  void factorise(std::span<const Vec3> gradient, std::span<const double> weights, double shift = 0);
  // The same where the equations are obeyed: components of orthogonal rows are diagonal then.
  void factorise_obeyed(std::span<const Vec3> gradient, std::span<const double> weights);
  void solve(double* x);  // x := A^-1 x, in the order of the rows

  int dependent() const;                             // rows that follow from others, as it seems
  int first_dependent() const;                       // -1: none
  std::size_t fill() const { return rows_.size(); }  // numbers of L

 private:
  struct Product {  // w_i g_a . g_b, a part of one entry of A
    int a, b, node;
  };
  struct Place {
    int column, slot;
  };

  struct Component {
    int begin = 0, end = 0;   // places of the order
    std::size_t work = 0;     // of it and those before
    bool orthogonal = false;  // its rows, for equal weights
    bool diagonal = false, shifted = false;
    int dependent = 0, first_dependent = -1;
  };

  void analyse(const std::vector<std::vector<int>>& columns);
  template <class Body>
  void for_each(const Body& body);
  void factorise(Component& of, std::span<const Vec3> gradient, std::span<const double> weights,
                 double shift);
  void add_up(const Component& of, std::span<const Vec3> gradient, std::span<const double> weights);
  bool fill_diagonal(const Component& of, std::span<const Vec3> gradient,
                     std::span<const double> weights);
  bool eliminate(Component& of, double shift);
  void substitute(const Component& of, double* x) const;
  void multiply(const Component& of, const double* x, double* out) const;
  void refine(const Component& of);

  int size_;
  ThreadPool* pool_ = nullptr;
  std::vector<Component> components_;
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
};

}  // namespace sim
