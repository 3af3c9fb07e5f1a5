#include "body_joints.h"

#include <algorithm>

#include "core/math/axes.h"

namespace sim {

BodyJoints::BodyJoints(Particles& particles, ConstraintSystem& constraint_system)
    : particles_(&particles),
      constraint_system_(&constraint_system),
      end_(constraint_system.internal_begin() + constraint_system.internal_size()),
      change_(end_.size()),
      moved_(end_.size()),
      shift_(static_cast<std::size_t>(particles.layout().n())),
      other_(shift_.size()) {}

void BodyJoints::begin(const BodyCollision& body_collision, std::span<const int> entered,
                       double t_end, const double* x_next) {
  body_collision_ = &body_collision, entered_ = entered, t_end_ = t_end;
  moves_ = false;
  std::copy_n(x_next, end_.size(), end_.data());
  std::ranges::fill(shift_, Vec3());
  std::ranges::fill(other_, std::uint8_t{1});
  arms_.clear();
  inertia_.clear();
  const ParticleView view = particles_->view(t_end, end_.data());
  for (int i = 0; i < view.n; ++i)
    if (!view.free(i)) other_[static_cast<std::size_t>(i)] = 0;
  for (int b = 0; b < body_collision.bodies(); ++b) {
    const RigidBody& body = body_collision.body(b);
    const RigidState state = body.state(view);
    inertia_.push_back(body.inverse_inertia(state));
    for (int p = 0; p < RigidBody::kParticles; ++p) {
      arms_.push_back(view.position(body.first() + p) - state.center);
      other_[static_cast<std::size_t>(body.first() + p)] = 0;
    }
  }
  for (const int i : entered) other_[static_cast<std::size_t>(i)] = 0;
  constraint_system_->begin_projections(t_end, end_.data());
}

void BodyJoints::begin_moves() {
  moves_ = true;
  std::ranges::fill(moved_.span(), 0.0);
}

// change_alone: the solver bodies hold changes of velocity, from zero. The rows are homogeneous for
// these and for moves.
void BodyJoints::project(std::span<SolverBody> solver_bodies, bool change_alone) {
  Array& state = change_alone ? change_ : moves_ ? moved_ : end_;
  const auto v = particles_->layout().axes(state.data(), 3);
  if (change_alone)
    for (double* const axis : v) std::fill_n(axis, particles_->layout().n(), 0.0);
  const auto bodies = static_cast<std::size_t>(body_collision_->bodies());
  for (std::size_t m = 0; m < solver_bodies.size(); ++m) {
    if (solver_bodies[m].inverse_mass == 0) continue;
    if (m >= bodies) {
      put_vector(v, entered_[m - bodies], solver_bodies[m].velocity);
      continue;
    }
    for (std::size_t p = 0; p < RigidBody::kParticles; ++p)
      put_vector(
          v, body_collision_->body(static_cast<int>(m)).first() + static_cast<int>(p),
          solver_bodies[m].velocity + solver_bodies[m].angular_velocity.cross(arms_[4 * m + p]));
  }
  constraint_system_->project(v, !change_alone && !moves_);

  for (std::size_t m = 0; m < solver_bodies.size(); ++m) {
    if (solver_bodies[m].inverse_mass == 0) continue;
    if (m >= bodies) {
      solver_bodies[m].velocity = vector_at(v, entered_[m - bodies]);
      continue;
    }
    // The rigid velocity of four particles, each with a quarter of the mass.
    const RigidBody& body = body_collision_->body(static_cast<int>(m));
    Vec3 sum, turning;
    for (std::size_t p = 0; p < RigidBody::kParticles; ++p) {
      const Vec3 each = vector_at(v, body.first() + static_cast<int>(p));
      sum += 0.25 * each;
      turning += 0.25 * body.mass() * arms_[4 * m + p].cross(each);
    }
    solver_bodies[m].velocity = sum, solver_bodies[m].angular_velocity = inertia_[m] * turning;
  }
}

void BodyJoints::end_moves() {
  const auto moved = particles_->layout().axes(moved_.data(), 3);
  for (std::size_t i = 0; i < other_.size(); ++i)
    if (other_[i]) shift_[i] += vector_at(moved, static_cast<int>(i));
}

bool BodyJoints::store(double* x_next) {
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3), now = layout.axes(end_.data(), 3);
  for (std::size_t k = 0; k < other_.size(); ++k) {
    const int i = static_cast<int>(k);
    if (!other_[k] || shift_[k] == Vec3()) continue;
    put_vector(q, i, vector_at(q, i) + shift_[k]);
    put_vector(v, i, vector_at(now, i));
  }
  return constraint_system_->project_state(t_end_, x_next, true);
}

}  // namespace sim
