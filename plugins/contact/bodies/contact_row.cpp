#include "contact_row.h"

#include <algorithm>
#include <cmath>

namespace sim {

ContactRow::ContactRow(std::span<const SolverBody> bodies, const ContactPoint& of,
                       std::size_t index)
    : first(of.first),
      second(of.second),
      contact(index),
      frame(of.normal, of.u, of.v),
      arm{of.arm1, of.arm2},
      friction(of.friction),
      impulse(of.normal_impulse, of.tangent_impulse[0], of.tangent_impulse[1]) {
  // W = sum of D (1/m + [arm]^T I^-1 [arm]) D^T over the bodies, with the frame D.
  Mat3 response;
  const auto add = [&](std::size_t side, int index_of_body) {
    const SolverBody& body = bodies[static_cast<std::size_t>(index_of_body)];
    inverse_mass[side] = body.inverse_mass;
    Vec3 moment[3], turn[3];
    for (std::size_t k = 0; k < 3; ++k) {
      moment[k] = arm[side].cross(frame.row(k));
      turn[k] = body.inverse_inertia * moment[k];
    }
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t l = k; l < 3; ++l)
        response(k, l) += (k == l ? body.inverse_mass : 0) + moment[k].dot(turn[l]);
  };
  add(0, first);
  if (second >= 0)
    add(1, second);
  else
    offset = -(frame * of.ground);
  offset[0] += of.offset;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t l = 0; l < k; ++l) response(k, l) = response(l, k);
    scale[k] = std::sqrt(response(k, k));
  }
  point = PointResponse::of(response);
}

Vec3 ContactRow::velocity(std::span<const SolverBody> bodies) const {
  const auto of = [&](std::size_t side, int body) {
    const SolverBody& at = bodies[static_cast<std::size_t>(body)];
    return Vec3(at.velocity + at.angular_velocity.cross(arm[side]));
  };
  Vec3 w = of(0, first);
  if (second >= 0) w -= of(1, second);
  return frame * w + offset;
}

// Calls change(body, velocity, angular velocity) with what an impulse changes these by.
template <class Change>
void ContactRow::each_side(std::span<SolverBody> bodies, const Vec3& added,
                           const Change& change) const {
  const Vec3 p = added[0] * frame.row(0) + added[1] * frame.row(1) + added[2] * frame.row(2);
  const auto act = [&](std::size_t side, int body, const Vec3& impulse_of) {
    if (!(inverse_mass[side] > 0)) return;  // it may belong to other islands, too
    SolverBody& of = bodies[static_cast<std::size_t>(body)];
    change(of, inverse_mass[side] * impulse_of, of.inverse_inertia * arm[side].cross(impulse_of));
  };
  act(0, first, p);
  act(1, second, -p);
}

void ContactRow::apply(std::span<SolverBody> bodies, const Vec3& added) const {
  each_side(bodies, added, [](SolverBody& body, const Vec3& velocity, const Vec3& turn) {
    body.velocity += velocity;
    body.angular_velocity += turn;
  });
}

void ContactRow::move(std::span<SolverBody> bodies, const Vec3& added, double duration) const {
  each_side(bodies, added, [&](SolverBody& body, const Vec3& velocity, const Vec3& turn) {
    body.translation += duration * velocity;
    body.rotation += duration * turn;
  });
}

double ContactRow::residual(const Vec3& w, const Vec3& p) const {
  const Vec3 added = coulomb_impulse(point, friction, w, p) - p;
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k)
    most = std::max(most, scale[k] * scale[k] * std::fabs(added[k]));
  return most;
}

}  // namespace sim
