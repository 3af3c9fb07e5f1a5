// The Schur complement of the Lagrange multipliers, A = J W J^T, and its factors.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/thread_pool.h"
#include "core/linear/row_pattern.h"
#include "core/linear/row_structure.h"
#include "core/math/vec3.h"

namespace sim {

// A is sparse: rows are coupled where they share a free node. The pattern is analysed once; a
// chain takes time linear in its links. A = L D L^T row by row (Davis (2006), Direct Methods for
// Sparse Linear Systems, section 4.7), in the given order or in one of little fill (Amestoy, Davis
// & Duff (1996)). Where much fill is left, as in nets, the factors are panels.
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
  // The matrix is one of several of the same rows.
  explicit RowMatrix(std::shared_ptr<const RowStructure> structure);
  RowMatrix(RowMatrix&&) noexcept;
  RowMatrix& operator=(RowMatrix&&) noexcept;
  ~RowMatrix();

  void share(ThreadPool* pool) { pool_ = pool; }  // between its threads; null: the caller alone

  // shift: e, if rows are known to be nearly dependent; 0: if they are found to be.
  void factorise(std::span<const Vec3> gradient, std::span<const double> weights, double shift = 0);
  // The same where the equations are obeyed: components of orthogonal rows are diagonal then.
  void factorise_obeyed(std::span<const Vec3> gradient, std::span<const double> weights);
  void solve(double* x);  // x := A^-1 x, in the order of the rows

  int dependent() const;        // rows that follow from others, as it seems
  int first_dependent() const;  // -1: none
  std::size_t fill() const;     // numbers of L

 private:
  struct Component;

  template <class Body>
  void for_each(const Body& body);
  void factorise(Component& of, std::span<const Vec3> gradient, std::span<const double> weights,
                 double shift);
  void add_up(const Component& of, std::span<const Vec3> gradient, std::span<const double> weights);
  bool fill_diagonal(const Component& of, std::span<const Vec3> gradient,
                     std::span<const double> weights);
  bool eliminate(Component& of, double shift);
  bool eliminate_rows(Component& of, double shift);
  bool eliminate_panels(Component& of, double shift);
  void find_dependent(Component& of);
  double& diagonal_of(int place);  // the entry of A
  void substitute(const Component& of, double* x) const;
  void multiply(const Component& of, const double* x, double* out) const;
  void refine(const Component& of);

  std::shared_ptr<const RowStructure> structure_;
  ThreadPool* pool_ = nullptr;
  std::vector<Component> components_;
  std::vector<double> entries_;  // of A, as the structure has them
  std::vector<double> values_;   // of L, by columns without its diagonal
  std::vector<double> inverse_, work_, x_, rest_, found_;
  std::vector<std::uint8_t> empty_;  // rows in which nothing moves
};

}  // namespace sim
