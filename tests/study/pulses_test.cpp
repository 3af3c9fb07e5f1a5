#include "core/study/verdict/pulses.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/scene/simulation.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// The shortest pulse of a force along x beside gravity, within 6 s, s.
double shortest(const std::string& force) {
  sim::SystemSpec spec = make_falling(1, 0);
  if (!force.empty()) spec.forces.push_back(make_part("expression", {{"fx", force}}));
  sim::Registry registry = make_registry();
  sim::Simulation run(spec, registry, {.integrator = "rk4", .dt = 0.5});
  return sim::study::shortest_pulse(run, 6);
}

}  // namespace

TEST_CASE("the shortest pulse of a force is found", "[study][verdict]") {
  const std::string long_one = "100*step(t - 1)*step(1.5 - t)";
  const double found = shortest(long_one + " - 100*step(t - 3.1)*step(3.11 - t)");
  CHECK(found > 0.0099);
  CHECK(found < 0.0101);
  CHECK(std::abs(shortest(long_one) - 0.5) < 1e-3);
  // Shorter than two samples.
  const double spike = shortest("1e5*step(t - 3.1)*step(3.1004 - t)");
  CHECK(spike > 3.9e-4);
  CHECK(spike < 4.1e-4);
}

TEST_CASE("forces that last, or change as fast as they are large, are no pulses",
          "[study][verdict]") {
  for (const char* force : {"", "100", "100*sin(50*t)", "20*step(t - 3)"}) {
    INFO(force);
    CHECK(std::isinf(shortest(force)));
  }
}
