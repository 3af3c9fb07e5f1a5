// Observed orders of every integrator there is: halving the step divides the error by 2^p.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

// The state after `duration`, in `steps` steps; empty when the method diverged.
std::vector<double> final_state(const sim::SystemSpec& spec, const std::string& method,
                                double duration, int steps, sim::Registry& registry) {
  sim::Simulation simulation(spec, registry, fixed_steps(method, duration / steps, registry));
  if (!run(simulation, steps)) return {};
  return state_of(simulation);
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return HUGE_VAL;
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

struct Case {
  std::string name;
  sim::SystemSpec spec;
  double duration;   // s
  int first, exact;  // steps of the coarsest run, and of the reference by dop853
};

std::vector<Case> cases() {
  return {{"circle", make_circle(), 4, 4, 80},
          {"vertical spring", make_vertical_spring(0), 1, 4, 120},
          {"vertical spring with drag", make_vertical_spring(1.5), 1, 4, 120},
          {"elastic pendulum", make_elastic_pendulum(), 1, 4, 160},
          {"elastic pendulum with drag", make_elastic_pendulum(0.5), 1, 4, 160},
          {"cloth", make_cloth(5, {.drag = 0}), 0.1, 5, 120},
          {"cloth with drag", make_cloth(5), 0.1, 5, 120}};
}

}  // namespace

// Steps are halved until two successive ratios of errors agree with the order, above rounding
// errors. A method of another order never gets there. Between steps that are too large and rounding
// high orders leave room for few ratios: there one is enough.
TEST_CASE("every integrator has the order it declares, with and without drag") {
  sim::Registry registry = make_registry();
  constexpr int kMostSteps = 1 << 16;
  for (const Case& scene : cases()) {
    const std::vector<double> exact =
        final_state(scene.spec, "dop853", scene.duration, scene.exact, registry);
    const double doubt = distance(
        final_state(scene.spec, "dop853", scene.duration, scene.exact / 2, registry), exact);
    INFO(scene.name << ": reference changes by " << doubt << " at half its steps");
    REQUIRE(doubt < 1e-13);
    const double floor = 1e-14 + doubt;
    for (const std::string& method : methods_with_order(scene.spec, registry)) {
      sim::Simulation simulation(scene.spec, registry, fixed_steps(method, 0.01, registry));
      const int order = simulation.integrator_info().order;
      std::string trail;
      int agreed = 0;
      double coarse = HUGE_VAL;
      const int needed = order > 4 ? 1 : 2;
      const double margin = order > 4 ? 0.3 : 0.15;
      for (int steps = scene.first; agreed < needed && steps <= kMostSteps; steps *= 2) {
        const double fine =
            distance(final_state(scene.spec, method, scene.duration, steps, registry), exact);
        if (fine < floor) break;
        const double observed = std::log2(coarse / fine);
        agreed = std::fabs(observed - order) <= margin ? agreed + 1 : 0;
        coarse = fine;
        trail += " " + std::to_string(observed);
      }
      INFO(scene.name << ", " << method << " of order " << order << ", observed" << trail);
      CHECK(agreed == needed);
    }
  }
}

// Errors on the 8 x 8 cloth with drag at t = 1 s, rms over the coordinates of all particles in
// m, of implementations in other arithmetic against the exact positions.
TEST_CASE("a step buys the accuracy that the textbook methods have") {
  struct Accuracy {
    const char* method;
    int steps;
    double rms;
  };
  sim::Registry registry = make_registry();
  const Table table("cloth8.csv");
  for (const auto& [method, steps, rms] : {Accuracy{"verlet", 128, 3.00e-4},
                                           {"pefrl", 64, 1.094e-5},
                                           {"rk4", 128, 1.482e-5},
                                           {"trapezoid", 256, 3.017e-4}}) {
    sim::Simulation simulation(make_cloth(8), registry, {.integrator = method, .dt = 1.0 / steps});
    REQUIRE(run(simulation, steps));
    double sum = 0;
    int count = 0;
    for (const Row& row : table.rows_where("t", 1.0)) {
      const int i = static_cast<int>(row.number("particle"));
      const sim::Vec3 exact(row.number("x"), row.number("y"), row.number("z"));
      sum += (simulation.position(i) - exact).squaredNorm();
      count += 3;
    }
    INFO(method);
    CHECK(std::sqrt(sum / count) == Approx(rms).epsilon(0.01));
  }
}
