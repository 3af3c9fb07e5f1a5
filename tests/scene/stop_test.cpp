// A long step can be given up on the way, and taken again with the same bits.
#include <catch2/catch.hpp>

#include "core/lua/scene/scene_file.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// Takes `count` steps of both, of which those of `stopped` are given up later and later until they
// get through; how often.
int give_up(sim::Simulation& whole, sim::Simulation& stopped, int count, int growth) {
  int stops = 0;
  for (int n = 0; n < count; ++n) {
    REQUIRE(whole.step());
    for (int patience = 0;; patience = growth * patience + 1) {
      int asked = 0;
      const std::uint64_t before = stopped.hash();
      stopped.stop_when([&] { return ++asked > patience; });
      if (stopped.step()) break;
      ++stops;
      REQUIRE(stopped.divergence().status == sim::StepStatus::kStopped);
      CHECK(stopped.hash() == before);
    }
    CHECK(stopped.hash() == whole.hash());
  }
  return stops;
}

}  // namespace

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
    CHECK(give_up(whole, stopped, 3, 3) >= 3);
  }
}

TEST_CASE("a step of many particles is given up between its parts") {
  sim::Registry registry = make_registry();
  for (const char* method : {"euler", "rk4", "verlet", "pefrl", "dopri5", "trbdf2", "imex"})
    for (const int threads : {1, 3}) {
      INFO(method << " on " << threads << " threads");
      const sim::RunOptions options{
          .integrator = sim::MethodChoice(method), .dt = 1e-4, .threads = sim::Threads(threads)};
      sim::Simulation whole(make_cloth(100), registry, options);
      sim::Simulation stopped(make_cloth(100), registry, options);
      CHECK(give_up(whole, stopped, 2, 2) >= 2);
    }
}

TEST_CASE("a step of any scene that is given up can be taken again with the same bits") {
  const std::vector<std::filesystem::path> path{std::filesystem::path(SIM_SOURCE_DIR) / "scripts"};
  sim::Registry registry = make_registry();
  int given_up = 0;
  for (const std::string& name : sim::list_scenes(path))
    for (const sim::SystemSpec& system :
         sim::load_scene(name, registry, {.search_path = path}).systems) {
      INFO(name);
      sim::Simulation whole(system, registry), stopped(system, registry);
      given_up += give_up(whole, stopped, 6, 2) > 0 ? 1 : 0;
    }
  CHECK(given_up >= 10);
}
