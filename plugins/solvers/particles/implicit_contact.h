// Contact inside the equations of implicit steps, by velocity inequalities.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/implicit_solvers.h"
#include "core/particles/particles.h"
#include "core/particles/velocity_inequality.h"

namespace sim {

// A step of size h from x is taken in rounds, each with all of its stages, until no new contact is
// found:
//
// - A resting contact, or a particle that has touched a surface, may not penetrate at the end of a
//   stage: gap(t, q + v ..) >= 0, which is a half-space of its velocity, n.v >= b, with the normal
//   at the stage and b from the gap of the round before. Moreau (1988); Stewart & Trinkle (1996),
//   Int. J. Numer. Meth. Eng. 39.
// - An impact, found on the cubic path through both ends, bounces: the next round begins where a
//   particle with the new velocity would have come from, x - s h dv, v + dv. So forces between
//   particles see the bounce.
// - Friction is mu times the normal impulse of the round before against the slip, to first order in
//   the slip, or makes the particle stick if it is below the Coulomb limit.
//
// At the end an active contact removes the separating velocity. All of it is a pure function of t,
// h, x and the method, and local to a particle but for the equations.
class ImplicitContact final : public StageContact {
 public:
  explicit ImplicitContact(Particles& particles);

  const double* begin(double t, double h, const double* x, bool again) override;
  StepEnd end(double* x_next, bool bounces) override;
  bool had_impact() const noexcept override { return had_impact_; }

  // The inequalities of the stage Y - tau f = r at time t; null if there is no contact near.
  VelocityInequalities* bounds(double t, double tau, const StageOptions& method, const double* r);
  void solved(const double* y);  // the solution of that stage

  void accelerate(const ParticleView& view, double* const a[3]) const override;

 private:
  struct Held {
    int particle = 0, count = 0, turns = 0;
    Collider* collider[VelocityInequality::kMost] = {};
    double since[VelocityInequality::kMost] =
        {};  // s: start of contact, before which the path does not count
    bool sticking = false;
    double sticking_since = 0;  // s, and where
    Vec3 place{0, 0, 0};

    std::span<Collider* const> all() const { return {collider, static_cast<std::size_t>(count)}; }
    void add(Collider* what, double t) {
      if (count < VelocityInequality::kMost) since[count] = t, collider[count++] = what;
    }
  };
  struct Stage {
    double t = 0, tau = 0, reach = 1;
    bool first_order = false;
    const double* r = nullptr;
    VelocityInequalities bounds;
    std::vector<Vec3> velocity;  // of each, in the round before
    std::vector<Friction> friction;

    double span() const { return reach * tau; }  // from r to where the end is, along v
    double end() const { return t + (reach - 1) * tau; }
  };

  void find_held(const double* x);
  bool find_impacts(const double* x_next);
  void hit(int i, const Contacts::Impact& impact);
  void linearise_friction(Stage& stage, std::size_t index);
  void finish(double* x_next);
  void put_out(double* x_next, bool project);
  Held* held(int i);                               // null: no contact
  Held& entered(int i);                            // it does from now on
  std::span<Collider* const> colliders_at(int i);  // the colliders that it touches
  Vec3 surface_velocity(const Held& held, double t, const Vec3& x) const;

  Particles* particles_;
  double t_ = 0, h_ = 0;
  int round_ = 0;
  std::size_t stage_ = 0;
  bool again_ = false, had_impact_ = false, begun_ = false;
  Array start_;  // start of the stages, if not x
  const double* from_ = nullptr;
  std::vector<Held> held_;
  std::vector<int> index_;                          // of each particle in held_; -1: none
  std::vector<std::pair<int, ContactWork>> blows_;  // J
  std::vector<Stage> stages_;
};

}  // namespace sim
