// Makes the explicit kicks of another program reproduce our exact drag.
#pragma once

#include "core/math/exponential.h"
#include "core/math/vec3.h"

namespace sim::engine {

// The methods of scenes that another program can step, too; the first two by kicks.
enum class Method { kVerlet, kSymplecticEuler, kRk4, kImplicitEuler, kImplicitMidpoint, kTrBdf2 };

// Velocity Verlet with a force that reads velocities (LAMMPS: fix nve, fix viscous) makes its whole
// kick of the velocity u between two states, in two halves around each state:
//   u := u + h (F - c u) / m'
// Ours is exact, u := e^-y u + h phi a with y = g h, g = c / m, a = F / m and phi = (1 - e^-y) / y.
// With the mass m' = m / phi they are the same map: 1 - h c phi / m = 1 - y phi = e^-y.
//
// Only the first kick is half an explicit one there. It makes our first u of a start w:
//   w + h/2 (F - c w) / m' = w (1 - y phi / 2) + h phi a / 2
// where our first u is what a kick of h/2 (verlet), or of h (symplectic Euler), makes of v:
//   w = (keep v + (gain - h phi / 2) a) / (1 - y phi / 2),   1 - y phi / 2 = (1 + e^-y) / 2 > 0
// Back: after a step there are w = u + h/2 f / m' and f = F - c u. So u = w - h/2 f / m', which is
// the velocity of symplectic Euler, and verlet's is what a kick of h/2 with a = (f + c u) / m
// makes.
class KickMap {
 public:
  // Mass in kg, drag in kg/s, h in s.
  KickMap(Method method, double mass, double drag, double h)
      : method_(method), mass_(mass), drag_(drag), h_(h) {
    const double rate = drag / mass;
    half_ = damping(rate, h / 2);
    whole_ = damping(rate, h);
  }

  double phi() const { return whole_.gain / h_; }
  double mass() const { return mass_ / phi(); }  // m', kg

  // w, from our velocity and the acceleration without drag, at the start.
  Vec3 start(const Vec3& v, const Vec3& a) const {
    const Damping& kick = method_ == Method::kVerlet ? half_ : whole_;
    return (kick.keep * v + (kick.gain - whole_.gain / 2) * a) / ((1 + whole_.keep) / 2);
  }

  // Our velocity, from the velocity and the force there after a step.
  Vec3 velocity(const Vec3& w, const Vec3& f) const {
    const Vec3 u = w - (whole_.gain / (2 * mass_)) * f;
    if (method_ == Method::kSymplecticEuler) return u;
    return half_.keep * u + (half_.gain / mass_) * (f + drag_ * u);
  }

 private:
  Method method_;
  double mass_, drag_, h_;
  Damping half_{}, whole_{};
};

}  // namespace sim::engine
