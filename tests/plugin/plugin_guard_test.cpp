// Plugins that throw, or change how the processor rounds.
#include <catch2/catch.hpp>
#include <cfenv>

#include "core/base/md5.h"
#include "core/base/thread_pool.h"
#include "core/scene/simulation.h"
#include "tests/support/scenes.h"

using Catch::Matchers::Contains;

namespace {

sim::Registry wild_registry() {
  return sim::Registry({SIM_PLUGIN_DIR}, {std::string(SIM_FIXTURE_DIR) + "/wild/wild.so"});
}

sim::SystemSpec wild_cloth(const std::map<std::string, sim::Value>& given) {
  sim::SystemSpec spec = sim_test::make_cloth(4);
  sim::PartSpec part;
  part.plugin = "wild";
  part.given = given;
  part.place = "scene.lua:7";
  spec.forces.push_back(part);
  return spec;
}

template <class Action>
std::string plugin_error(Action action) {
  try {
    action();
  } catch (const sim::Error& error) {
    CHECK(error.kind() == sim::ErrorKind::kPlugin);
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("an exception of a plugin is an error that names it") {
  sim::Registry registry = wild_registry();
  CHECK_THAT(plugin_error([&] {
               sim::Simulation(wild_cloth({{"early", true}}), registry);
             }),
             Contains("force 'wild' of ") && Contains("wild.so: scene.lua:7: ") &&
                 Contains("the cat sat on the constructor (while it was made)"));
  const sim::SystemSpec spec = wild_cloth({{"at", 0.02}});
  for (const char* integrator : {"rk4", "verlet", "dopri5", "implicit_midpoint"}) {
    INFO(integrator);
    sim::Simulation simulation(spec, registry,
                               sim::RunOptions{.integrator = integrator, .dt = 0.005});
    CHECK_THAT(plugin_error([&] {
                 for (int i = 0; i < 10; ++i) simulation.step();
               }),
               Contains(std::string(integrator) == "dopri5" ? "'dopri5' or a force: the cat"
                                                            : "force 'wild': the cat") &&
                   Contains(" (in step ") && Contains(" from t = "));
  }
}

TEST_CASE("an exception in a shorter step is the same error as in any other") {
  sim::Registry registry = wild_registry();
  const sim::SystemSpec spec = wild_cloth({{"at", 0.0205}});
  for (const char* integrator : {"rk4", "verlet", "implicit_midpoint"}) {
    INFO(integrator);
    sim::Simulation simulation(spec, registry, {.integrator = integrator, .dt = 0.01});
    for (int i = 0; i < 2; ++i) REQUIRE(simulation.step());
    CHECK_THAT(plugin_error([&] { simulation.step_to(0.021); }),
               Contains("the cat") && Contains(" (in step 3 from t = 0.02 s)"));
    CHECK(simulation.step_count() == 2);
    CHECK(simulation.step_to(0.0204));  // still possible
  }
}

TEST_CASE("a member of a team may throw") {
  sim::ThreadPool pool(3);
  for (int thrower = 0; thrower < 3; ++thrower) {
    CHECK_THROWS_AS(pool.run([&](int rank) {
      if (rank == thrower) throw std::runtime_error("thrown");
    }),
                    std::runtime_error);
    std::atomic<int> count{0};
    pool.run([&](int) { ++count; });
    CHECK(count == 3);
  }
}

TEST_CASE("a plugin cannot change how others round") {
  sim::Registry registry = wild_registry();
  sim::Simulation simulation(wild_cloth({{"rounds", true}}), registry);
  for (int i = 0; i < 3; ++i) REQUIRE(simulation.step());
  CHECK(std::fegetround() == FE_TONEAREST);
  sim::ThreadPool pool(2);
  pool.run([](int) { std::fesetround(FE_UPWARD); });
  std::fesetround(FE_TONEAREST);
  std::atomic<int> wrong{0};
  pool.run([&](int) { wrong += std::fegetround() != FE_TONEAREST; });
  CHECK(wrong == 0);
}

// RFC 1321, appendix A.5.
TEST_CASE("checksums are those of the standard") {
  CHECK(sim::md5("") == "d41d8cd98f00b204e9800998ecf8427e");
  CHECK(sim::md5("message digest") == "f96b697d7cb7938d525a2f31aaf161d0");
  CHECK(sim::md5(
            "12345678901234567890123456789012345678901234567890123456789012345678901234567890") ==
        "57edf4a22be3c955ac49da2e2107b67a");
}
