// A rigid body as four particles.
#pragma once

#include <array>
#include <memory>

#include "core/geometry/render_shape.h"
#include "core/geometry/rigid_shape.h"
#include "core/particles/view.h"

namespace sim {

// The state of a rigid body. The columns of `axes` are the axes of its shape.
struct RigidState {
  Vec3 center, velocity, angular_velocity;  // of mass, m, m/s; rad/s
  Mat3 axes = Mat3::Identity();

  std::array<double, 4> quaternion() const;  // w, x, y, z of length 1, w >= 0
};

// d_k = sum of sign_pk x_p / (4 extent_k), the principal axes as the particles span them, and d_k'.
struct Directors {
  std::array<Vec3, 3> d{}, rate{};
};

// Four particles of a quarter of the mass each, at the corners (+ + +), (+ - -), (- + -), (- - +)
// of a box of half edges `extent` about the center of mass, along the principal axes: they have the
// mass, the center and the moments of the body, and hence its motion (Routh (1905), Elementary
// Rigid Dynamics, art. 33-46). Its axes are linear in them: natural coordinates (Garcia de Jalon &
// Bayo (1994), Kinematic and Dynamic Simulation of Multibody Systems).
class RigidBody {
 public:
  static constexpr int kParticles = 4;

  // first: the id of its first particle. mass > 0, kg. Throws Error{kScene} if the shape has no
  // mass in some direction.
  RigidBody(std::shared_ptr<const RigidShape> shape, double mass, int first);

  int first() const { return first_; }
  double mass() const { return mass_; }
  const RigidShape& shape() const { return *shape_; }
  const Vec3& extent() const { return extent_; }  // m
  const Vec3& share() const { return share_; }    // 1 / (4 extent), 1/m, of particles in directors
  const Vec3& center() const { return center_; }  // of mass, in the frame of the shape, m
  double radius() const;                          // m, of a ball about the center that holds it
  Vec3 moments() const;                           // of inertia, about the principal axes, kg m^2
  Mat3 inertia(const RigidState& state) const;    // about its center, in space, kg m^2
  Mat3 inverse_inertia(const RigidState& state) const;

  static double sign(int particle, std::size_t axis) {
    return particle == 0 || static_cast<std::size_t>(particle) == axis + 1 ? 1 : -1;
  }
  Vec3 corner(const RigidState& state, int particle) const;  // from the center, m
  // The weights of a point of the body, given in the frame of the shape: its position is the
  // weighted sum of those of the four particles, at all times.
  std::array<double, kParticles> weights(const Vec3& at) const;

  RigidState state(const ParticleView& view) const;
  // The directors from positions and velocities relative to x0 and v0, which reduces rounding
  // errors.
  Directors directors(const ParticleView& view, const Vec3& x0, const Vec3& v0) const;
  Vec3 place(const RigidState& state, const Vec3& at) const {
    return state.center + state.axes * (at - center_);
  }
  RenderShape drawn(const RigidState& state) const;

 private:
  std::shared_ptr<const RigidShape> shape_;
  double mass_;
  int first_;
  Vec3 center_, extent_, share_;
  Mat3 principal_;  // columns, in the frame of the shape
};

// A particle, or a point of a body: a weighted sum of particles, with constant weights that add up
// to 1. A force on the point acts on each of them by its weight, with the same work and the same
// moment.
struct JointNode {
  int count = 0;  // of particles, 1 or 4
  std::array<int, 4> ids{};
  std::array<double, 4> weights{};
};

}  // namespace sim
