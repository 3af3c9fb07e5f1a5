// Holonomic constraints on particles: equations phi(t, x) = 0, enforced by forces that do no work
// of their own.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/linear/row_pattern.h"
#include "core/particles/view.h"

namespace sim {

class Breakable;

// The equations of one constraint at one state, as evaluate() writes them.
struct Rows {
  double* phi;     // of each row, best in m, or the tolerances mean something else
  Vec3* gradient;  // d phi / d x of each particle of each row, in the order of the pattern
  double* drive;   // d phi / d t of each row, with x at rest
  double* bias;    // d2 phi / d t2 of each row, without accelerations: J' v of a constraint at rest
};

// A constraint is a pure function of (t, X), as forces are; called on one thread.
class Constraint {
 public:
  virtual ~Constraint() = default;

  // Called once with the initial state; may allocate and may throw Error.
  virtual void bind(const ParticleView& /*initial*/) {}

  virtual RowPattern pattern() const = 0;  // after bind(); without ties that are broken
  virtual void evaluate(const ParticleView& view, const Rows& rows) const = 0;  // all of them

  // True if phi depends on t: such a constraint may do work.
  virtual bool moves() const { return false; }

  // Internal variables of the constraint in X (`internal` of its view), which follow from the
  // positions, such as the parameter of a point on a curve: their initial values, and their values
  // at a state that satisfies the equations.
  virtual int internal_size() const { return 0; }
  virtual void start(std::span<double> /*memory*/) const {}
  virtual void follow(const ParticleView& /*view*/, std::span<double> /*memory*/) const {}

  // Second derivatives that are multiples of the unit matrix, d2 phi / dx_a dx_b = c I: c in 1/m of
  // each row and of each pair a <= b of its particles, (0, 0), (0, 1), .., (1, 1), .., initialised
  // to 0. Long steps of flexible chains need them, see ImplicitDrift; all others may be left out.
  virtual void curvature(const ParticleView& /*view*/, double* /*pairs*/) const {}

  // True if rows that share particles have orthogonal gradients, for equal masses, wherever all
  // rows are obeyed: their multipliers are then independent of each other.
  virtual bool orthogonal() const { return false; }

  // Its ties that may break; null: none does. Known before bind().
  virtual Breakable* breakable() { return nullptr; }

  // "rod 3-7", in errors and tables.
  virtual std::string name(int row) const { return "equation " + std::to_string(row); }
  // The reason why evaluate() gave numbers that are not finite just now; may be empty.
  virtual std::string complaint() const { return {}; }
  // A note for the user, one sentence; may be empty.
  virtual std::string note() const { return {}; }
};

// A curve in space, which may move: a point for each s and t. May throw Error{kScene}.
class Curve {
 public:
  virtual ~Curve() = default;
  virtual Vec3 at(double s, double t) const = 0;
  virtual bool moves() const = 0;  // it depends on t
};

}  // namespace sim
