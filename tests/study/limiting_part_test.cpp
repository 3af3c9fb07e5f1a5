// The limit of the step of a method that takes a part of f explicitly.
#include <catch2/catch.hpp>

#include "core/study/limits/spectrum.h"
#include "core/study/verdict/verdict.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

sim::SystemSpec make_seam(double stiffness) {
  sim::SystemSpec spec = make_cloth(8);
  sim::PartSpec seam = make_springs("seam", stiffness);
  for (int j = 0; j < 7; ++j) seam.elements.add({56 + j, 57 + j});
  spec.forces.push_back(seam);
  return spec;
}

}  // namespace

TEST_CASE("the soft part limits the steps of imex, for a verdict too") {
  sim::Registry registry = make_registry();
  const double h = 0.004;
  const sim::SystemSpec stiff = make_seam(1e6), plain = make_cloth(8);
  sim::Simulation imex(stiff, registry, {.integrator = "imex", .dt = h});
  sim::Simulation verlet(plain, registry, {.integrator = "verlet", .dt = h});
  const double soft = sim::study::fastest_vibration(verlet, 40).omega;
  CHECK(sim::study::limiting_vibration(verlet, 40).omega == soft);
  CHECK(sim::study::limiting_vibration(imex).omega == Approx(soft).epsilon(0.02));
  CHECK(sim::study::fastest_vibration(imex, 40).omega > 80 * soft);
  sim::study::Monitor monitor(stiff, imex, 10000, &registry);
  const sim::Energy energy = imex.energy();
  monitor.look(&energy);
  const sim::study::Verdict verdict = monitor.verdict();
  CHECK(verdict.figures.dt_share == Approx(h * soft / 2).epsilon(0.03));
}
