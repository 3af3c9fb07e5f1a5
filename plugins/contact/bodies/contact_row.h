// A contact point in the solvers of resting contact.
#pragma once

#include <span>

#include "contact_solver.h"
#include "coulomb_point.h"

namespace sim {

struct ContactRow {
  int first = 0, second = -1;
  std::size_t contact = 0;
  double inverse_mass[2] = {};
  Mat3 frame;   // its rows: the normal, u and v
  Vec3 arm[2];  // of both bodies, m
  Vec3 offset;  // m/s, along the three, without the bodies: of a collider, and of the gap
  PointResponse point;
  double friction = 0;
  Vec3 impulse, scale;  // N s, along the three; sqrt(W_kk), which makes all unknowns alike

  ContactRow() = default;
  ContactRow(std::span<const SolverBody> bodies, const ContactPoint& of, std::size_t index);

  // The velocity of the first body, relative to the second, with the offset of the normal one.
  Vec3 velocity(std::span<const SolverBody> bodies) const;
  void apply(std::span<SolverBody> bodies, const Vec3& added) const;
  // Moves the bodies by an impulse that has acted for a time, s.
  void move(std::span<SolverBody> bodies, const Vec3& added, double duration) const;
  // The largest change of velocity, m/s, that the point alone requires, which has the velocity w.
  double residual(const Vec3& w, const Vec3& p) const;

 private:
  template <class Change>
  void each_side(std::span<SolverBody> bodies, const Vec3& added, const Change& change) const;
};

}  // namespace sim
