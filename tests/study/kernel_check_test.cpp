// A judged run compares its kernels with plain code: what is wrong is named, what is right is not.
#include <catch2/catch.hpp>
#include <random>

#include "core/lua/scene/scene_file.h"
#include "core/particles/particle_system.h"
#include "core/study/verdict/reference_forces.h"
#include "core/study/verdict/verdict.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::Trust;
using sim::study::Verdict;

namespace {

sim::Registry registry_with_wrong_kernels() {
  return sim::Registry({SIM_PLUGIN_DIR}, {SIM_FIXTURE_DIR "/wrong_kernels/wrong_kernels.so",
                                          SIM_FIXTURE_DIR "/unseen_floor/unseen_floor.so"});
}

Verdict verdict_of(const sim::SystemSpec& spec, sim::Registry& registry, std::int64_t steps = 40,
                   const std::string& integrator = "rk4", double dt = 1e-3) {
  sim::Simulation simulation(spec, registry, {.integrator = integrator, .dt = dt});
  sim::study::Monitor monitor(spec, simulation, steps, &registry);
  for (std::int64_t i = 0; i <= steps; ++i) {
    if (i > 0) {
      REQUIRE(simulation.step());
      monitor.advance();
    }
    const sim::Energy energy = simulation.energy();
    monitor.look(&energy);
  }
  return monitor.verdict();
}

bool says(const Verdict& verdict, const std::string& words) {
  return verdict.reason.find(words) != std::string::npos;
}

bool blames_a_kernel(const Verdict& verdict) { return says(verdict, "a kernel is wrong"); }

// Particles anywhere, each tied to some others by springs that all differ.
sim::SystemSpec make_net(int n, int ties) {
  std::mt19937 random(static_cast<unsigned>(n));
  std::uniform_real_distribution<double> any(0, 1);
  sim::SystemSpec spec = make_chain({}, {}, 0.1);
  spec.particles->pinned.clear();
  spec.forces = {make_gravity(), make_drag(0.1), make_springs("tie", 100)};
  for (int i = 0; i < n; ++i)
    spec.particles->list.push_back({{any(random), any(random), any(random)},
                                    {any(random), any(random), any(random)},
                                    0.1 + any(random)});
  std::uniform_int_distribution<int> id(0, n - 1);
  for (int tie = 0; tie < ties; ++tie) {
    const int a = id(random), b = id(random);
    if (a != b)
      spec.forces.back().elements.add({a, b},
                                      {{"stiffness", 100 * any(random)}, {"rest", any(random)}});
  }
  return spec;
}

}  // namespace

TEST_CASE("a wrong lane of a force is named") {
  sim::Registry registry = registry_with_wrong_kernels();
  for (const int n : {4, 9, 13}) {
    sim::SystemSpec spec = make_net(n, 0);
    spec.forces = {make_part("wrong_lane")};
    const Verdict verdict = verdict_of(spec, registry);
    INFO(verdict.reason);
    CHECK(verdict.trust == Trust::kSuspect);
    CHECK(says(verdict, "force 'wrong_lane' on particle 3 is ("));
    CHECK(says(verdict, "evaluated alone ("));
  }
}

TEST_CASE("a spring that a kernel evaluates wrongly by 1e-9 is named by its family") {
  sim::Registry registry = registry_with_wrong_kernels();
  // A scene in Lua may say 100 or 100.0.
  for (const sim::Value& stiffness : {sim::Value(std::int64_t{100}), sim::Value(100.0)}) {
    sim::SystemSpec spec = make_net(9, 0);
    for (const char* name : {"right", "wrong"}) {
      sim::PartSpec springs = make_springs(name, 100);
      springs.given["stiffness"] = stiffness;
      springs.given["rest"] = 0.5;
      const int apart = name[0] == 'w' ? 1 : 2;
      for (int i = 0; i + apart < 9; ++i) springs.elements.add({i, i + apart});
      if (name[0] == 'w') springs.plugin = "wrong_spring";
      spec.forces.push_back(springs);
    }
    const Verdict verdict = verdict_of(spec, registry);
    INFO(verdict.reason);
    CHECK(verdict.trust == Trust::kSuspect);
    CHECK(says(verdict, "the force of springs 'wrong' on particle 7 is ("));
  }
}

TEST_CASE("a potential that is wrong by 1e-9 is named by its force") {
  sim::Registry registry = registry_with_wrong_kernels();
  for (const std::string name : {"wrong_weight", "wrong_energy"}) {
    sim::SystemSpec spec = make_net(9, 0);
    sim::PartSpec force = make_part(name);
    if (name == "wrong_energy") {
      force = make_springs("link", 100);
      force.plugin = name;
      force.given["rest"] = 0.5;
      for (int i = 1; i < 9; ++i) force.elements.add({i - 1, i});
    }
    spec.forces.push_back(force);
    const Verdict verdict = verdict_of(spec, registry);
    INFO(verdict.reason);
    CHECK(verdict.trust == Trust::kSuspect);
    CHECK(says(verdict, "the potential energy of force '" + name));
    CHECK(says(verdict, " of the kernel is "));
  }
}

TEST_CASE("plain potentials are sums over particles and springs, of each force its own") {
  sim::Registry registry = make_registry();
  for (const int n : {1, 9, 1024, 1025}) {
    INFO(n);
    const sim::SystemSpec spec = make_net(n, 3 * n);
    sim::Simulation simulation(spec, registry);
    const auto& particles = dynamic_cast<const sim::ParticleSystem&>(simulation.ode());
    const sim::study::ReferenceForces plain(spec, particles,
                                            particles.view(0, simulation.state().data()), {});
    REQUIRE(plain.known());
    double weights = 0, springs = 0;
    for (const sim::ParticleSpec& each : spec.particles->list)
      weights += each.mass * kGravity * each.position.y();
    const sim::Elements& ties = spec.forces.back().elements;
    ties.for_each([&](const sim::Element& tie) {
      const auto at = [&](std::size_t end) {
        return spec.particles->list[static_cast<std::size_t>(tie.ids[end])].position;
      };
      const double k = ties.values.at("stiffness")[static_cast<std::size_t>(tie.index)];
      const double r = ties.values.at("rest")[static_cast<std::size_t>(tie.index)];
      springs += 0.5 * k * std::pow((at(0) - at(1)).norm() - r, 2);
    });
    std::vector<double> expected{weights, 0};  // gravity and drag
    if (n <= 1024) expected.push_back(springs);
    REQUIRE(plain.potentials().size() == expected.size());
    for (std::size_t f = 0; f < expected.size(); ++f) {
      CHECK(plain.potentials()[f].force == particles.forces()[f]);
      CHECK(plain.potentials()[f].energy == Approx(expected[f]).epsilon(1e-12).margin(1e-12));
      CHECK(plain.potentials()[f].scale >= std::fabs(expected[f]));
    }
  }
}

TEST_CASE("a particle inside a collider that contact did not see is named") {
  sim::Registry registry = registry_with_wrong_kernels();
  sim::SystemSpec spec = make_particle({0, 0.01, 0}, {0, -1, 0}, make_part("unseen_floor"));
  const Verdict verdict = verdict_of(spec, registry, 100);
  INFO(verdict.reason);
  CHECK(verdict.trust == Trust::kSuspect);
  CHECK(says(verdict, "particle 0 is 0."));
  CHECK(says(verdict, "contact saw nothing of it"));
}

TEST_CASE("kernels that are right are not blamed, whatever the number of particles") {
  sim::Registry registry = make_registry();
  for (int n = 1; n <= 40; ++n) {
    INFO(n);
    for (const char* method : {"rk4", "verlet"}) {
      const Verdict net = verdict_of(make_net(n, 3 * n), registry, 5, method);
      INFO(net.reason);
      CHECK_FALSE(blames_a_kernel(net));
    }
    if (n < 2 || n > 12) continue;
    const Verdict cloth = verdict_of(make_cloth(n), registry, 5);
    INFO(cloth.reason);
    CHECK_FALSE(blames_a_kernel(cloth));
  }
  // Large enough for a choice of particles.
  CHECK_FALSE(blames_a_kernel(verdict_of(make_cloth(40), registry, 5)));
  CHECK_FALSE(blames_a_kernel(verdict_of(make_net(1500, 9000), registry, 5)));
}

TEST_CASE("kernels of extreme and degenerate springs are not blamed") {
  sim::Registry registry = make_registry();
  for (const double scale : {1e-200, 1e-120, 1e-3, 1e6, 1e120, 1e200}) {
    sim::SystemSpec spec = make_net(12, 30);
    for (sim::ParticleSpec& particle : spec.particles->list) {
      particle.position *= scale;
      particle.velocity *= scale;
    }
    spec.particles->list[1].position = spec.particles->list[0].position;
    sim::PartSpec springs = make_springs("zero", 10);
    springs.given["rest"] = 0.0;
    springs.elements.add({0, 1});
    springs.elements.add({2, 3});
    spec.forces.push_back(springs);
    sim::Simulation simulation(spec, registry, {.integrator = "rk4", .dt = 1e-6});
    sim::study::Monitor monitor(spec, simulation, 5, &registry);
    const Verdict verdict = monitor.verdict();
    INFO(scale << ' ' << verdict.reason);
    CHECK_FALSE(blames_a_kernel(verdict));
  }
}

TEST_CASE("kernels of the scenes of this program are not blamed") {
  sim::Registry registry = make_registry();
  for (const std::string file : {"bounce", "cloth_ball", "dam", "drape_rods", "flag", "gas", "hoop",
                                 "jelly", "jelly_fem", "rope", "stack", "hammock"}) {
    const sim::SceneSpec scene =
        sim::load_scene("scenes/" + file + ".lua", registry, {{SIM_SOURCE_DIR "/scripts"}, {}});
    const sim::SystemSpec& spec = scene.systems.front();
    const Verdict verdict = verdict_of(spec, registry, 60, spec.integrator.name, spec.dt);
    INFO(file << ": " << verdict.reason);
    CHECK_FALSE(blames_a_kernel(verdict));
  }
}
