// Checkpoints: bit for bit, and refused when they are not what they should be.
#include "core/scene/checkpoint.h"

#include <catch2/catch.hpp>
#include <random>

#include "core/base/error.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Simulation;

namespace {

sim::Checkpoint checkpoint_of(const Simulation& simulation, const sim::SystemSpec& spec) {
  return {"scene.lua", {{"n", "4"}}, 3, {sim::checkpoint(simulation, spec, 0.5)}};
}

sim::ErrorKind kind_of(const std::string& bytes) {
  try {
    sim::decode(bytes, "file");
  } catch (const sim::Error& error) {
    return error.kind();
  }
  return sim::ErrorKind::kInternal;
}

}  // namespace

TEST_CASE("a run goes on bit for bit from a checkpoint, with every integrator") {
  sim::Registry registry = make_registry();
  int count = 0;
  for (const sim::SystemSpec& spec : {make_cloth(5), make_circle()})
    for (const std::string& name : registry.names<sim::Integrator>()) {
      std::optional<Simulation> first;
      try {
        first.emplace(spec, registry, sim::RunOptions{.integrator = name, .dt = 1e-4});
      } catch (const sim::Error&) {
        continue;  // it does not fit
      }
      INFO(name);
      REQUIRE(run(*first, 37));
      if (first->second_order()) first->set_pinned(12, true);
      first->set_dt(5e-5);
      REQUIRE(run(*first, 10));
      const std::string bytes = encode(checkpoint_of(*first, spec));
      const sim::Checkpoint read = sim::decode(bytes, "file");
      CHECK(read.scene == "scene.lua");
      CHECK(read.settings == std::map<std::string, std::string>{{"n", "4"}});
      CHECK(read.seed == 3);
      CHECK(read.systems[0].start_energy == 0.5);

      Simulation second(spec, registry);
      sim::resume(second, spec, read.systems[0], registry);
      CHECK(second.t() == first->t());
      CHECK(second.hash() == first->hash());
      REQUIRE(run(*first, 100));
      REQUIRE(run(second, 100));
      CHECK(second.hash() == first->hash());
      ++count;
    }
  CHECK(count >= 8);
}

TEST_CASE("a checkpoint of another scene is refused, and nothing is changed") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(5);
  Simulation from(cloth, registry);
  REQUIRE(run(from, 10));
  const sim::Checkpoint saved = checkpoint_of(from, cloth);
  sim::SystemSpec other = make_cloth(5, {.drag = 1});
  Simulation simulation(other, registry);
  const std::uint64_t hash = simulation.hash();
  CHECK_THROWS_AS(sim::resume(simulation, other, saved.systems[0], registry), sim::Error);
  CHECK(simulation.hash() == hash);

  for (const auto& spoil : std::vector<std::function<void(sim::Checkpoint::System&)>>{
           [](auto& s) { s.h = 0; }, [](auto& s) { s.h = INFINITY; }, [](auto& s) { s.step = -1; },
           [](auto& s) { s.pinned = {99}; },
           [](auto& s) {
             s.pinned = {3, 1};
           },
           [](auto& s) { s.x[20] = NAN; }, [](auto& s) { s.x.pop_back(); }}) {
    sim::Checkpoint::System spoilt = saved.systems[0];
    spoil(spoilt);
    CHECK_THROWS_AS(sim::resume(from, cloth, spoilt, registry), sim::Error);
  }
}

TEST_CASE("damaged files are refused") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(4);
  const Simulation simulation(cloth, registry);
  const std::string bytes = encode(checkpoint_of(simulation, cloth));
  CHECK_NOTHROW(sim::decode(bytes, "file"));
  CHECK(kind_of("") == sim::ErrorKind::kCheckpoint);
  CHECK(kind_of("SIMSNAP\n") == sim::ErrorKind::kCheckpoint);
  CHECK(kind_of(bytes + "x") == sim::ErrorKind::kCheckpoint);
  for (std::size_t size = 0; size < bytes.size(); size += 97)
    CHECK(kind_of(bytes.substr(0, size)) == sim::ErrorKind::kCheckpoint);
  std::minstd_rand random(1);
  for (int i = 0; i < 300; ++i) {
    std::string spoilt = bytes;
    spoilt[random() % spoilt.size()] ^= static_cast<char>(1 + random() % 255);
    CHECK(kind_of(spoilt) == sim::ErrorKind::kCheckpoint);
  }
}
