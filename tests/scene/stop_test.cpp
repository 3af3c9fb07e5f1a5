// A long step can be given up on the way, and taken again with the same bits.
#include <catch2/catch.hpp>

#include "tests/support/scenes.h"

using namespace sim_test;

TEST_CASE("a step that is stopped leaves no trace") {
  sim::Registry registry = make_registry();
  struct Long {
    const char* method;
    double h;
    std::map<std::string, sim::Value> given = {};
  };
  for (const Long& run : {Long{"dopri5", 1},
                          {"dop853", 1},
                          {"auto", 0.5},
                          {"auto", 0.5, {{"tol", 1e-9}}},
                          {"implicit_euler", 0.1},
                          {"trbdf2", 0.1},
                          {"bdf2", 0.1},
                          {"projective_dynamics", 0.1}}) {
    INFO(run.method << ", h = " << run.h);
    const sim::RunOptions options{.integrator = {run.method, run.given}, .dt = run.h};
    sim::Simulation whole(make_cloth(9), registry, options);
    sim::Simulation stopped(make_cloth(9), registry, options);
    int stops = 0;
    for (int n = 0; n < 3; ++n) {
      REQUIRE(whole.step());
      // Later and later into the step, until it gets through.
      for (int patience = 1;; patience *= 3) {
        int asked = 0;
        const std::uint64_t before = stopped.hash();
        stopped.stop_when([&] { return ++asked > patience; });
        if (stopped.step()) break;
        ++stops;
        CHECK(stopped.divergence().status == sim::StepStatus::kStopped);
        CHECK(stopped.hash() == before);
      }
      CHECK(stopped.hash() == whole.hash());
    }
    CHECK(stops >= 3);
  }
}
