// A matrix of 3 x 3 blocks that is applied without being assembled.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "core/base/layout.h"
#include "core/math/mat3.h"

namespace sim {

// A, and D, the blocks on its diagonal. A vector has three coordinates of every node, in layout().
class BlockMatrix {
 public:
  using VisitPair = std::function<void(int, int, const Mat3&)>;
  virtual ~BlockMatrix() = default;

  virtual const Layout& layout() const noexcept = 0;
  virtual bool stopped() const = 0;  // polled by solvers, which then leave their work undone
  // True if A is restricted to a subspace, in which apply() and precondition() then stay, unlike
  // the blocks that the functions below give.
  virtual bool restricted() const noexcept = 0;
  virtual double stiffness_ratio() const = 0;  // of the largest entry of D to its smallest part

  virtual double apply(const double* p, double* out) = 0;       // out := A p, returns p.out
  virtual double precondition(const double* r, double* z) = 0;  // z := D^-1 r, returns r.z
  // p := z + beta p, out := A p, returns p.out.
  virtual double turn_and_apply(double beta, const double* z, double* p, double* out) = 0;
  // d += alpha p, r -= alpha ap, z := D^-1 r, returns r.z.
  virtual double advance(double alpha, const double* p, const double* ap, double* d, double* r,
                         double* z) = 0;

  virtual Mat3 diagonal(int i) const = 0;  // the block of D
  // The pairs (a, b), a < b, whose blocks are there at any time, in the order of for_each_pair().
  virtual std::vector<std::array<int, 2>> fixed_pairs() const = 0;
  // The blocks off the diagonal: fixed(a, b, block) of each fixed pair, symmetric ones, and
  // other(i, j, block), of which half of the symmetric part of A is given for each of (i, j) and
  // (j, i).
  virtual void for_each_pair(const VisitPair& fixed, const VisitPair& other) const = 0;
};

}  // namespace sim
