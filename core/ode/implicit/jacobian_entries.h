// df/dX of a system by its entries.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/math/sparsity.h"
#include "core/ode/state_shape.h"

namespace sim {

class Jacobian;
class OdeSystem;

class JacobianEntries {
 public:
  virtual ~JacobianEntries() = default;

  virtual const Sparsity& sparsity() const = 0;

  // Evaluates the entries at a point, in the order of the sparsity.
  virtual void at(double t, const double* x, std::span<double> values) = 0;

  // Searches there for entries that were not known; true if there are any.
  virtual bool look_again(double /*t*/, const double* /*x*/) { return false; }

  virtual std::int64_t evaluations() const { return 0; }  // of f so far
};

// The Jacobian of a system that does not know its sparsity pattern: perturbed inputs near the point
// x show the outputs that change. The groups of columns that certainly share no row are changed at
// once and halved, so that n numbers with a few neighbours each take some multiple of log n
// evaluations, not n. Values are forward differences, all columns that share no row at once
// (Curtis, Powell & Reid (1974), J. Inst. Maths Applics 13, 117-119).
std::unique_ptr<JacobianEntries> difference_entries(OdeSystem& system, double t, const double* x);

// J of the numbers of a state, without its padding, column by column. Each costs a product.
class JacobianColumns {
 public:
  explicit JacobianColumns(const StateShape& shape);

  std::span<const std::size_t> places() const { return places_; }  // of the numbers in the state
  // values := J at its point: the rows of each column.
  void write(Jacobian& jacobian, std::span<double> values);

 private:
  std::vector<std::size_t> places_;
  Array unit_, column_;
};

// All entries of a small system, column by column from its Jacobian.
std::unique_ptr<JacobianEntries> all_entries(OdeSystem& system);

// Colours the columns so that two of one colour share no row; returns the number of colours.
int color_columns(const Sparsity& sparsity, std::span<int> colors);

}  // namespace sim
