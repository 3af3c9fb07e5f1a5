// A run that is judged as sim judges it, and systems of which the error is known.
#pragma once

#include <catch2/catch.hpp>

#include "core/study/verdict/step_doubling.h"
#include "core/study/verdict/verdict.h"
#include "tests/support/scenes.h"

namespace sim_test {

struct Judged {
  sim::study::RunDeviation deviation;
  sim::study::Verdict verdict;
  std::vector<double> end{};  // positions at the last state
};

// Runs `steps` steps as sim does, with `looks` looks, and then the shadow, or from step `beside`
// on.
inline Judged judged(const sim::SystemSpec& spec, const sim::RunOptions& options,
                     std::int64_t steps, int looks = 100, std::int64_t beside = -1) {
  sim::Registry registry = make_registry();
  sim::Simulation system(spec, registry, options);
  sim::study::Monitor monitor(spec, system, steps, &registry);
  sim::study::StepDoubling shadow(spec, system, steps, registry);
  const std::int64_t stride = std::max<std::int64_t>(1, steps / looks);
  for (std::int64_t n = 0; n <= steps; ++n) {
    if (n > 0) {
      REQUIRE(system.step());
      monitor.advance();
    }
    if (n % stride != 0 && n != steps) continue;
    const sim::Energy energy = system.energy();
    monitor.look(system.second_order() ? &energy : nullptr);
    shadow.look(system.second_order() ? &energy : nullptr, spec.observe(system));
    if (n / stride == beside / stride && beside >= 0)
      CHECK(shadow.follow_beside([] { return false; }));
  }
  const std::uint64_t hash = system.hash();
  Judged result;
  result.end = sim::study::positions(system);
  result.deviation = shadow.compare([] { return false; });
  CHECK(system.hash() == hash);  // the run itself is left alone
  result.verdict = monitor.verdict(result.deviation);
  return result;
}

inline sim::SystemSpec make_field(std::vector<double> start, sim::OdeFunction f) {
  sim::SystemSpec spec;
  spec.name = "field";
  spec.integrator = "rk4";
  spec.dt = 0.01;
  spec.first_order.emplace();
  spec.first_order->dimension = 1;
  spec.first_order->state = std::move(start);
  spec.first_order->field = make_part("lua", {{"f", std::move(f)}});
  return spec;
}

// x'' = -x from (1, 0): the error of a method is known.
inline sim::SystemSpec make_oscillator() {
  return make_field({1, 0}, [](double, std::span<const double> x, std::span<double> d) {
    d[0] = x[1];
    d[1] = -x[0];
  });
}

}  // namespace sim_test
