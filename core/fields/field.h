// A first-order right-hand side: positions move with a velocity that is a function of (t, X).
#pragma once

#include <span>

namespace sim {

// x and dxdt hold one number a component of a flat state, or x0 y0 z0 x1 y1 z1 ... of particles.
// Pure, and single-threaded: eval is called on one thread at a time.
class Field {
 public:
  virtual ~Field() = default;

  // Called once; throws Error when the field does not fit a state of that many numbers.
  // dimension is 3 for particles, 1 for a flat state.
  virtual void bind(std::size_t /*size*/, int /*dimension*/) {}

  virtual void eval(double t, std::span<const double> x, std::span<double> dxdt) const = 0;
};

}  // namespace sim
