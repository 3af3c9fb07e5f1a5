#include "contact_row.h"

#include <algorithm>
#include <cmath>

namespace sim {

ContactRow::ContactRow(std::span<const SolverBody> bodies, const ContactPoint& of,
                       std::size_t index)
    : first(of.first),
      second(of.second),
      contact(index),
      friction(of.friction),
      offset(of.offset),
      impulse(of.normal_impulse, of.tangent_impulse[0], of.tangent_impulse[1]) {
  const Vec3 directions[3] = {of.normal, of.u, of.v};
  for (std::size_t k = 0; k < 3; ++k) {
    Direction& d = direction[k];
    d.along = directions[k];
    const auto turn = [&](std::size_t side, int index_of_body, const Vec3& arm) {
      const SolverBody& body = bodies[static_cast<std::size_t>(index_of_body)];
      inverse_mass[side] = body.inverse_mass;
      d.moment[side] = arm.cross(d.along);
      d.turn[side] = body.inverse_inertia * d.moment[side];
    };
    turn(0, of.first, of.arm1);
    if (of.second >= 0)
      turn(1, of.second, of.arm2);
    else
      d.ground = d.along.dot(of.ground);
  }
  Mat3 response;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t l = k; l < 3; ++l) {
      const Direction &a = direction[k], &b = direction[l];
      response(k, l) = response(l, k) = (k == l ? inverse_mass[0] + inverse_mass[1] : 0) +
                                        a.moment[0].dot(b.turn[0]) + a.moment[1].dot(b.turn[1]);
    }
  point = PointResponse::of(response);
  for (std::size_t k = 0; k < 3; ++k) scale[k] = std::sqrt(response(k, k));
}

// The relative velocity d.(v1 - v2) + (arm1 x d).w1 - (arm2 x d).w2 in each direction.
Vec3 ContactRow::velocity(std::span<const SolverBody> bodies) const {
  const SolverBody& a = bodies[static_cast<std::size_t>(first)];
  Vec3 w;
  for (std::size_t k = 0; k < 3; ++k) {
    const Direction& d = direction[k];
    w[k] = d.along.dot(a.velocity) + d.moment[0].dot(a.angular_velocity) - d.ground;
  }
  if (second >= 0) {
    const SolverBody& b = bodies[static_cast<std::size_t>(second)];
    for (std::size_t k = 0; k < 3; ++k) {
      const Direction& d = direction[k];
      w[k] -= d.along.dot(b.velocity) + d.moment[1].dot(b.angular_velocity);
    }
  }
  return w + Vec3(offset, 0, 0);
}

void ContactRow::apply(std::span<SolverBody> bodies, const Vec3& added) const {
  const Direction* const d = direction;
  const Vec3 whole = added[0] * d[0].along + added[1] * d[1].along + added[2] * d[2].along;
  const auto turn = [&](std::size_t side) {
    return added[0] * d[0].turn[side] + added[1] * d[1].turn[side] + added[2] * d[2].turn[side];
  };
  if (inverse_mass[0] > 0) {
    SolverBody& a = bodies[static_cast<std::size_t>(first)];
    a.velocity += inverse_mass[0] * whole;
    a.angular_velocity += turn(0);
  }
  if (inverse_mass[1] > 0) {
    SolverBody& b = bodies[static_cast<std::size_t>(second)];
    b.velocity -= inverse_mass[1] * whole;
    b.angular_velocity -= turn(1);
  }
}

double ContactRow::residual(const Vec3& w, const Vec3& p) const {
  const Vec3 added = coulomb_impulse(point, friction, w, p) - p;
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k)
    most = std::max(most, scale[k] * scale[k] * std::fabs(added[k]));
  return most;
}

}  // namespace sim
