// A first-order right-hand side: positions move with a velocity that is a function of (t, X).
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/math/sparsity.h"
#include "core/ode/ode_system.h"

namespace sim {

// Names for the numbers of a flat state that is a lattice: all names of cell 0, then of cell 1,
// ...; of cells (i, j, k) the last index runs fastest. Pictures draw it.
struct FieldLayout {
  std::vector<std::string> names;     // empty: nothing is known
  std::array<int, 3> cells{1, 1, 1};  // in each direction; 1 where there is none
};

// x and dxdt hold one number a component of a flat state, or x0 y0 z0 x1 y1 z1 ... of particles.
// Pure, and single-threaded: eval is called on one thread at a time.
class Field {
 public:
  virtual ~Field() = default;

  // Called once; throws Error when the field does not fit a state of that many numbers.
  // dimension is 3 for particles, 1 for a flat state.
  virtual void bind(std::size_t /*size*/, int /*dimension*/) {}
  // Then, with the state at the start; throws Error if it cannot begin there.
  virtual void begin(double /*t*/, std::span<const double> /*x*/) const {}

  virtual void eval(double t, std::span<const double> x, std::span<double> dxdt) const = 0;

  // The entries of df/dx that may differ from 0, and their values in that order. Null if the field
  // does not know them: they are found by differences. After bind().
  virtual const Sparsity* sparsity() const { return nullptr; }
  virtual void jacobian(double /*t*/, std::span<const double> /*x*/,
                        std::span<double> /*values*/) const {}

  virtual FieldLayout layout() const { return {}; }

  // A faster stepper for steps of a fixed-step method, with the bits of stage after stage; null:
  // none. The field outlives it.
  virtual std::unique_ptr<Stepper> explicit_stepper(const ExplicitPlan& /*plan*/) const {
    return nullptr;
  }
};

}  // namespace sim
