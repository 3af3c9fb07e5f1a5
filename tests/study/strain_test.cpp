// The approach of a spring to length zero, against motions in its field of force.
#include "core/study/verdict/strain.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

constexpr double kStiffness = 50, kMass = 2;

// A particle of 2 kg on a spring of 1 m and 50 N/m to the origin.
sim::study::Pinch pinch_of(const sim::Vec3& x, const sim::Vec3& v, double ahead) {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec;
  spec.name = "bead";
  spec.integrator = "verlet";
  spec.dt = 0.001;
  spec.particles.emplace().list = {{{0, 0, 0}, {0, 0, 0}, kMass}, {x, v, kMass}};
  spec.particles->pinned = {0};
  sim::PartSpec spring = make_springs("link", kStiffness);
  spring.elements.add({0, 1}, {{"rest", 1.0}});
  spec.forces = {spring};
  sim::Simulation bead(spec, registry);
  return sim::study::nearest_pinch(bead, ahead);
}

// Potential energy at this length, from that at the point.
double energy_at(double r) { return 0.5 * kStiffness * ((r - 1) * (r - 1) - 1); }

}  // namespace

TEST_CASE("a spring that is pressed to nearly a point turns where its energy says") {
  // Straight at the point with less energy than leads over it: it turns at r.
  for (const double r : {0.001, 0.01}) {
    INFO(r);
    const double from = 0.05, speed = std::sqrt(2 * (energy_at(r) - energy_at(from)) / kMass);
    const auto pinch = pinch_of({from, 0, 0}, {-speed, 0, 0}, 1);
    CHECK(pinch.margin == Approx(r).epsilon(0.02));
    CHECK(pinch.share < 1e-12);  // on a straight line it meets the point
    CHECK((pinch.a == 0 && pinch.b == 1));
  }
  // Past the point with just the energy that leads over it: nearest where the turning takes all of
  // it, m u^2 / 2 = -energy with r u = l.
  for (const double r : {0.001, 0.01}) {
    INFO(r);
    const double momentum = r * std::sqrt(-2 * energy_at(r) / kMass), from = 0.05;
    const double across = momentum / from, speed = std::sqrt(-2 * energy_at(from) / kMass);
    const double towards = std::sqrt(speed * speed - across * across);
    const auto pinch = pinch_of({from, 0, 0}, {-towards, across, 0}, 1);
    CHECK(pinch.margin == Approx(r).epsilon(0.02));
    CHECK(pinch.share == Approx(from * across / speed).epsilon(1e-9));
  }
}

TEST_CASE("a spring that does not come near a point is not looked at") {
  CHECK(pinch_of({0.2, 0, 0}, {0, 0, 0}, 1).a == -1);
  CHECK(pinch_of({0.2, 0, 0}, {0, 0, 0}, 1).margin == HUGE_VAL);
  CHECK(pinch_of({0.11, 0, 0}, {1, 0, 0}, 1).a == -1);     // it goes away
  CHECK(pinch_of({0.2, 0, 0}, {-1, 0, 0}, 0.05).a == -1);  // to 0.15 m in this time
  CHECK(pinch_of({0.2, 0, 0}, {-1, 0, 0}, 0.15).share == Approx(0.05));
}
