// The fastest vibration of scenes whose frequencies are known.
#include "core/study/limits/spectrum.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

sim::study::Spectrum spectrum_of(const sim::SystemSpec& spec) {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(spec, registry);
  return sim::study::spectrum(simulation);
}

}  // namespace

TEST_CASE("the 8 x 8 cloth at rest vibrates at 192.678 rad/s at most") {
  const auto found = spectrum_of(make_cloth(8));
  CHECK(found.fastest.omega == Approx(192.678).epsilon(1e-5));
  CHECK(found.fastest.damping == Approx(2).epsilon(1e-6));
  CHECK(found.residual < 1e-6);
  CHECK(found.bound == Approx(299.33).epsilon(1e-4));
  // Symmetric about the middle, and of the stiffest springs most of all.
  REQUIRE(found.particles.size() == 4);
  CHECK(found.particles[0].second == Approx(found.particles[1].second).epsilon(1e-3));
  REQUIRE(found.families.size() == 3);
  CHECK(found.families.front().first == "structural");
  double sum = 0;
  for (const auto& [family, share] : found.families) sum += share;
  CHECK(sum == Approx(1));
}

TEST_CASE("the modes of a chain are all found, without the direction of a spring counting twice") {
  const auto found = spectrum_of(make_row());
  const Table table("linear_chain.csv");
  CHECK(found.fastest.omega == Approx(table.rows().back().number("omega")).epsilon(1e-8));
  CHECK(found.fastest.damping == Approx(0).margin(1e-9));
  CHECK(found.growth < 1e-4 * found.fastest.omega);
  // 10 frequencies along the chain and 20 of zero across it; one of each is all that can be seen
  // from one start.
  for (const Row& row : table.rows()) {
    const double omega = row.number("omega");
    CHECK(std::any_of(found.vibrations.begin(), found.vibrations.end(), [&](const auto& mode) {
      return std::abs(mode.omega - omega) < 1e-6 * omega;
    }));
  }
  CHECK(found.bound == Approx(2 * std::sqrt(100 / 0.1)));
}

TEST_CASE("a first-order field has its eigenvalues") {
  const auto found = spectrum_of(make_circle());
  CHECK(found.fastest.omega == Approx(1));
  CHECK(found.fastest.damping == Approx(0).margin(1e-6));
  CHECK(std::isinf(found.bound));
}

TEST_CASE("unequal masses: the bound and the frequency of two particles on one spring") {
  sim::SystemSpec spec = make_row();
  spec.particles->list = {{.position = {0, 0, 0}, .mass = 1}, {.position = {1, 0, 0}, .mass = 3}};
  spec.particles->pinned.clear();
  spec.forces.front().elements = {};
  spec.forces.front().elements.add({0, 1}, {{"rest", 1}});
  const auto found = spectrum_of(spec);
  CHECK(found.fastest.omega == Approx(std::sqrt(100 * (1 + 1 / 3.0))).epsilon(1e-8));
  CHECK(found.bound >= found.fastest.omega);
}

TEST_CASE("a compressed spring buckles, which is growth and no vibration") {
  sim::SystemSpec spec = make_row();
  for (double& rest : spec.forces.front().elements.values["rest"]) rest = 1.5;
  CHECK(spectrum_of(spec).growth > 1);
}

TEST_CASE("nothing vibrates where nothing is tied, or nothing is free") {
  CHECK(spectrum_of(make_falling(1, 0)).fastest.omega == 0);
  sim::SystemSpec spec = make_row();
  spec.particles->pinned = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  CHECK(spectrum_of(spec).vibrations.empty());
}
