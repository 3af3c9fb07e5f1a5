// A contact point in the solvers of resting contact: its Jacobian along three directions.
#pragma once

#include <span>

#include "contact_solver.h"
#include "coulomb_point.h"

namespace sim {

struct ContactRow {
  struct Direction {
    Vec3 along, moment[2], turn[2];  // arm x along, and I^-1 of it, of both bodies
    double ground = 0;               // m/s, of a collider
  };

  int first = 0, second = -1;
  std::size_t contact = 0;
  double inverse_mass[2] = {};
  Direction direction[3];  // the normal, u and v
  PointResponse point;
  double friction = 0, offset = 0;
  Vec3 impulse, scale;  // N s, along the three; sqrt(W_kk), which makes all unknowns alike

  ContactRow() = default;
  ContactRow(std::span<const SolverBody> bodies, const ContactPoint& of, std::size_t index);

  // The velocity of the first body, relative to the second, with the offset of the normal one.
  Vec3 velocity(std::span<const SolverBody> bodies) const;
  void apply(std::span<SolverBody> bodies, const Vec3& added) const;
  // The largest change of velocity, m/s, that the point alone requires, which has the velocity w.
  double residual(const Vec3& w, const Vec3& p) const;
};

}  // namespace sim
