// The mass and the first velocity with which explicit kicks make ours, against both written out.
#include "core/engine/kick_map.h"

#include <catch2/catch.hpp>
#include <cmath>

namespace sim_test {
namespace {

using sim::Vec3;
using sim::engine::KickMap;
using sim::engine::Method;

// One particle on a spring of 40 N/m to the origin, under gravity.
constexpr double kMass = 0.3, kStiffness = 40, kStep = 0.02;

Vec3 acceleration(const Vec3& x) { return Vec3(1, -9.81, 2) - kStiffness / kMass * x; }

// The contract: v := e^(-g tau) v + (1 - e^(-g tau)) / g a.
Vec3 kick(const Vec3& v, const Vec3& a, double rate, double tau) {
  if (rate == 0) return v + tau * a;
  return std::exp(-rate * tau) * v - std::expm1(-rate * tau) / rate * a;
}

}  // namespace

TEST_CASE("explicit kicks of another mass are exact kicks with drag") {
  for (const double drag : {0.0, 1e-9, 0.2, 3.0, 200.0})
    for (const Method method : {Method::kVerlet, Method::kSymplecticEuler}) {
      INFO("drag " << drag);
      const double rate = drag / kMass;
      const bool verlet = method == Method::kVerlet;
      const KickMap map(method, kMass, drag, kStep);
      Vec3 x(0.5, -0.2, 0.1), v(1, 2, -3);
      Vec3 there = x, w = map.start(v, acceleration(x));
      const auto force = [&] { return kMass * acceleration(there) - drag * w; };
      Vec3 f = force();
      for (int step = 0; step < 50; ++step) {
        v = kick(v, acceleration(x), rate, verlet ? kStep / 2 : kStep);
        x += kStep * v;
        if (verlet) v = kick(v, acceleration(x), rate, kStep / 2);
        w += kStep / 2 / map.mass() * f;
        there += kStep * w;
        f = force();
        w += kStep / 2 / map.mass() * f;
        CHECK((there - x).norm() < 1e-13);
        CHECK((map.velocity(w, f) - v).norm() < 1e-11);
      }
    }
}

}  // namespace sim_test
