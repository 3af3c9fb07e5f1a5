// Observed orders: halving the step divides the error by 2^p.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// The state after `duration`, in steps of duration / steps.
std::vector<double> final_state(const sim::SystemSpec& spec, const std::string& method,
                                double duration, int steps, sim::Registry& registry) {
  sim::Simulation simulation(spec, registry, {.integrator = method, .dt = duration / steps});
  REQUIRE(run(simulation, steps));
  return state_of(simulation);
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

bool needs_particles(const std::string& method, sim::Registry& registry) {
  const sim::IntegratorPlugin& plugin = registry.integrator(method);
  return plugin.make({})->info().needs_second_order;
}

struct Case {
  std::string name;
  sim::SystemSpec spec;
  double duration;  // s
  int euler_steps, trapezoid_steps, rk4_steps, exact_steps;
};

// The step numbers are those where the leading error term rules and rounding does not.
std::vector<Case> cases() {
  return {{"circle", make_circle(), 1, 200, 100, 25, 4000},
          {"pendulum", make_elastic_pendulum(), 1, 8000, 400, 100, 8000},
          {"pendulum with drag", make_elastic_pendulum(0.5), 1, 8000, 400, 100, 8000},
          {"cloth", make_cloth(5, {.drag = 0}), 0.1, 10000, 500, 200, 8000},
          {"cloth with drag", make_cloth(5), 0.1, 10000, 500, 200, 8000}};
}

}  // namespace

TEST_CASE("methods have the order they declare") {
  sim::Registry registry = make_registry();
  for (const Case& scene : cases()) {
    const std::vector<double> exact =
        final_state(scene.spec, "rk4", scene.duration, scene.exact_steps, registry);
    const std::tuple<const char*, int, int> methods[] = {{"euler", 1, scene.euler_steps},
                                                         {"trapezoid", 2, scene.trapezoid_steps},
                                                         {"rk4", 4, scene.rk4_steps},
                                                         {"symplectic_euler", 1, scene.euler_steps},
                                                         {"verlet", 2, scene.trapezoid_steps}};
    for (const auto& [method, order, steps] : methods) {
      if (!scene.spec.particles && needs_particles(method, registry)) continue;
      const double coarse =
          distance(final_state(scene.spec, method, scene.duration, steps, registry), exact);
      const double fine =
          distance(final_state(scene.spec, method, scene.duration, 2 * steps, registry), exact);
      INFO(scene.name << ", " << method << ": errors " << coarse << " and " << fine);
      CHECK(std::log2(coarse / fine) == Approx(order).margin(0.05));
      sim::Simulation simulation(scene.spec, registry, {.integrator = method});
      CHECK(simulation.integrator_info().order == order);
    }
  }
}
