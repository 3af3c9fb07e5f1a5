// The approach of a spring to length zero, against motions in its field of force; and the worst
// strain, against a plain loop.
#include "core/study/verdict/strain.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

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

TEST_CASE("the worst strain is that of a loop over all springs that act") {
  sim::Registry registry = make_registry();
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  struct Tie {
    int a, b;
    double rest;
  };
  for (int trial = 0; trial < 93; ++trial) {
    const int n = 4 + trial % 20;
    sim::SystemSpec spec;
    spec.name = "net";
    spec.integrator = "verlet";
    spec.dt = 1e-3;
    spec.particles.emplace();
    std::vector<sim::Vec3> places;
    for (int i = 0; i < n; ++i) {
      places.push_back(
          {0.5 * i + 0.6 * ((i + 1) / 5), 0.2 * uniform(random), 0.2 * uniform(random)});
      spec.particles->list.push_back({.position = places.back(), .mass = 1});
    }
    // A run of one rest length, one of many, springs that fit no run, cables and struts.
    double worst = -1;
    int a = -1, b = -1;
    for (int family = 0; family < 5; ++family) {
      sim::PartSpec springs = make_springs("family " + std::to_string(family), 10);
      if (family == 3) springs.given["tension_only"] = true;
      if (family == 4) springs.given["compression_only"] = true;
      for (int i = 0; i < n; ++i) {
        int to = i + 1;
        if (family == 1) to = i + 2;
        if (family >= 2) to = static_cast<int>(random() % static_cast<unsigned>(n));
        // Every set of families, so that each is the worst in some.
        if (family == 0 && i % 5 == 3) continue;  // over a gap
        if (to >= n || to == i || !((1 + trial % 31) >> family & 1)) continue;
        const double rest = family == 0 ? (trial % 2 ? 0.6 : 0.54)
                                        : 0.5 + 0.4 * (trial % 3) + 0.3 * uniform(random);
        springs.elements.add({i, to}, {{"rest", rest}});
        const double strain =
            (places[static_cast<std::size_t>(i)] - places[static_cast<std::size_t>(to)]).norm() /
                rest -
            1;
        if ((family == 3 && strain < 0) || (family == 4 && strain > 0)) continue;
        if (std::abs(strain) > std::abs(worst) || a < 0)
          worst = strain, a = std::min(i, to), b = std::max(i, to);
      }
      if (springs.elements.listed() > 0) spec.forces.push_back(springs);
    }
    INFO("trial " << trial);
    sim::Simulation system(spec, registry);
    const sim::study::StrainedSpring found = sim::study::worst_spring(system);
    CHECK(std::min(found.a, found.b) == a);
    CHECK(std::max(found.a, found.b) == b);
    if (a >= 0) CHECK(found.strain == Approx(worst).epsilon(1e-12));
  }
}
