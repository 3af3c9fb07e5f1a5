// The largest stable steps, as methods say them and as they are measured.
#include "core/study/limits/stability.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/error.h"
#include "core/study/limits/step_limit.h"
#include "tests/lua/scene_text.h"
#include "tests/study/judged_run.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::MethodStability;

namespace {

sim::study::Watch no_watch() {
  return [](std::string_view, double) { return true; };
}

sim::study::Stability study_of(const sim::SystemSpec& spec,
                               const std::vector<sim::MethodChoice>& integrators = {}) {
  sim::Registry registry = make_registry();
  return sim::study::stability({&spec, &registry}, {.integrators = integrators}, no_watch());
}

const MethodStability& method_of(const sim::study::Stability& study, const std::string& name) {
  for (const MethodStability& each : study.methods)
    if (each.method.name == name) return each;
  throw std::runtime_error("no method " + name);
}

}  // namespace

TEST_CASE("steps of the 8 x 8 cloth with drag: predicted and measured") {
  const auto study = study_of(make_cloth(8), {{"euler"}, {"trapezoid"}, {"rk4"}, {"verlet"}});
  const std::vector<std::pair<std::string, double>> expected = {
      {"euler", 5.387e-5}, {"trapezoid", 1.8327e-3}, {"rk4", 1.474e-2}, {"verlet", 1.035e-2}};
  for (const auto& [name, dt] : expected) {
    INFO(name);
    const MethodStability& each = method_of(study, name);
    CHECK(each.predicted.value() == Approx(dt).epsilon(0.01));
    CHECK(each.measured.value() == Approx(each.predicted.value()).epsilon(1e-3));
  }
}

TEST_CASE("steps of a chain without drag agree within 2 %, and some methods have none") {
  const auto study = study_of(make_row());
  int stable = 0;
  for (const MethodStability& each : study.methods) {
    INFO(each.method.name);
    if (!each.predicted || !each.measured || std::isinf(*each.predicted)) continue;
    CHECK(*each.measured == Approx(*each.predicted).epsilon(0.02));
    stable += *each.predicted > 0;
  }
  CHECK(stable >= 3);
  const double omega = 62.60180466431455;
  CHECK(method_of(study, "rk4").measured.value() ==
        Approx(2.8284271247461901 / omega).epsilon(1e-4));
  CHECK(method_of(study, "verlet").measured.value() == Approx(2 / omega).epsilon(1e-4));
  for (const char* name : {"euler", "trapezoid"}) {
    CHECK(method_of(study, name).predicted.value() == 0);
    CHECK(method_of(study, name).measured.value() == 0);
  }
}

TEST_CASE("a scene in motion is held still for the measurement") {
  const auto study = study_of(make_elastic_pendulum(), {{"rk4"}, {"verlet"}});
  for (const MethodStability& each : study.methods)
    CHECK(each.measured.value() == Approx(each.predicted.value()).epsilon(1e-3));
}

TEST_CASE("what a system grows by itself is no fault of a step") {
  // A row pressed by a twentieth buckles at up to 14 1/s: half a step of that doubles it.
  sim::SystemSpec row = make_row();
  for (sim::ParticleSpec& each : row.particles->list) each.position *= 0.95;
  const auto study = study_of(row, {{"verlet"}, {"rk4"}});
  REQUIRE(study.spectrum.growth > 10);
  for (const MethodStability& each : study.methods) {
    INFO(each.method.name);
    REQUIRE(each.predicted.value() > 0.01);
    CHECK(each.measured.value() == Approx(each.predicted.value()).epsilon(0.01));
  }
}

TEST_CASE("particles of a fluid that drift off its surface are no fault of a step") {
  sim::Registry registry = make_registry();
  const sim::test::SceneFolder folder;
  const auto file = folder.write(
      "water.lua",
      "local sim, a = require 'sim', 0.05\n"
      "local p = sim.particles { mass = 1000*a^3 }\n"
      "for i = 0, 26 do p:add { (i//9 + 0.5)*a - 0.5, (i//3%3 + 0.5)*a, (i%3 + 0.5)*a } end\n"
      "local room = sim.collider.box { center = {0, 1, 1.5*a}, half = {0.5, 1, 1.5*a},\n"
      "  inside = true, thickness = a/4 }\n"
      "return sim.scene { particles = p, colliders = { room }, integrator = 'verlet', dt = 8e-4,\n"
      "  duration = 1, forces = { sim.force.gravity {}, sim.force.fluid { particles = p, density = "
      "1000,\n"
      "    boundary = { room }, speed_of_sound = 28, alpha = 0.16 } } }\n");
  const sim::SystemSpec spec =
      sim::load_scene(file, registry, {.search_path = {SIM_SOURCE_DIR "/scripts"}}).systems.front();
  const sim::study::Problem problem{&spec, &registry};
  sim::Simulation system = problem.simulation();
  const sim::study::Spectrum spectrum = sim::study::spectrum(system);
  sim::study::Standstill place(problem, system);
  // Below 2 / omega: pressure has a kink where a particle begins to feel it.
  const double limit = sim::study::measured_step(place, spectrum, {"verlet"}).value();
  CHECK(limit > 0.3 * 2 / spectrum.fastest.omega);
  CHECK(limit < 1.01 * 2 / spectrum.fastest.omega);
}

TEST_CASE("forces that change with time move what is at rest, and are no fault of a step") {
  sim::SystemSpec spec = make_row();
  spec.forces.push_back(make_part(
      "expression", {{"fx", std::string("1e-3*t")}, {"fy", std::string("1e-3*sin(3*t)")}}));
  sim::Registry registry = make_registry();
  const sim::study::Problem problem{&spec, &registry};
  sim::Simulation system = problem.simulation();
  const sim::study::Spectrum spectrum = sim::study::spectrum(system);
  sim::study::Standstill place(problem, system);
  const double omega = spectrum.fastest.omega;
  for (const auto& [method, limit] : {std::pair{"verlet", 2.0}, {"rk4", std::sqrt(8.0)}}) {
    INFO(method);
    CHECK(sim::study::measured_step(place, spectrum, {method}).value() ==
          Approx(limit / omega).epsilon(1e-3));
  }
}

TEST_CASE("splittings take drag of single particles by the midpoint rule") {
  sim::SystemSpec spec = make_row();
  spec.particles->list[3].mass = 1e-3;
  sim::PartSpec drag = make_drag(5);  // 5000 1/s
  drag.particles = std::vector<int>{3};
  spec.forces.push_back(drag);
  const auto study = study_of(spec, {{"verlet"}, {"symplectic_euler"}, {"rk4"}});
  CHECK(method_of(study, "verlet").predicted.value() == Approx(4.0 / 5000).epsilon(0.01));
  CHECK(method_of(study, "symplectic_euler").predicted.value() == Approx(2.0 / 5000).epsilon(0.01));
  CHECK(method_of(study, "rk4").predicted.value() == Approx(2.785 / 4960).epsilon(0.02));
  for (const MethodStability& each : study.methods) {
    INFO(each.method.name);
    CHECK(each.measured.value() == Approx(each.predicted.value()).epsilon(0.03));
  }
}

TEST_CASE("how long the rest takes is said when the vibrations are known") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_cloth(8);
  double told = -1;
  int done = 0, done_before = -1;
  sim::study::StabilityOptions options{.integrators = {{"rk4"}}};
  options.announce = [&](double seconds) {
    told = seconds;
    done_before = done;
  };
  const auto study = sim::study::stability({&spec, &registry}, options, [&](auto, double) {
    ++done;
    return true;
  });
  CHECK(told > 0);
  CHECK(done_before == 0);
  CHECK(study.methods.size() == 1);
}

TEST_CASE("the run may have an integrator that takes no loads") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(8);
  for (const sim::RunOptions& options :
       {sim::RunOptions{.integrator = "projective_dynamics"},
        sim::RunOptions{.integrator = {"rk4", {{"precision", std::string("single")}}}}}) {
    const auto study = sim::study::stability({&cloth, &registry, options},
                                             {.integrators = {{"verlet"}}}, no_watch());
    CHECK(method_of(study, "verlet").measured.value() == Approx(1.035e-2).epsilon(0.01));
  }
}

TEST_CASE("the energy goes wrong towards the limit, by the order of the method first") {
  sim::SystemSpec spec = make_elastic_pendulum();
  spec.duration = 10;
  const auto study = study_of(spec, {{"verlet"}, {"rk4"}});
  for (const MethodStability& each : study.methods) {
    REQUIRE(each.energy.size() == 4);
    CHECK(each.energy[1].error > 2 * each.energy[0].error);
    CHECK(each.energy[2].error > 2 * each.energy[1].error);
    CHECK(each.energy[0].dt == Approx(0.25 * each.measured.value()));
  }
  const auto& verlet = method_of(study, "verlet").energy;
  CHECK(verlet[1].error / verlet[0].error == Approx(4).margin(1));
}

// q'' = -w^2 q - c q': overdamped with w^2 = 0.198, whose decay of 1.539 1/s is the fastest motion,
// and underdamped with 2.217, which limits Euler's method to c / w^2.
TEST_CASE("the step of a flat system is limited by any of its modes") {
  constexpr double kDamping = 1.6679, kSlow = 0.198, kFast = 2.217;
  const sim::SystemSpec spec =
      make_field({1, 0, 1, 0}, [](double, std::span<const double> x, std::span<double> d) {
        d[0] = x[1];
        d[1] = -kSlow * x[0] - kDamping * x[1];
        d[2] = x[3];
        d[3] = -kFast * x[2] - kDamping * x[3];
      });
  const auto study = study_of(spec, {{"euler"}, {"implicit_euler"}});
  CHECK(step_limit(method_of(study, "euler")).value() == Approx(kDamping / kFast).epsilon(1e-3));
  CHECK(std::isinf(step_limit(method_of(study, "implicit_euler")).value()));
}

TEST_CASE("a method that says nothing of its stability is not predicted") {
  class Silent final : public sim::Integrator {
   public:
    sim::IntegratorInfo info() const noexcept override { return {.order = 1, .evaluations = 1}; }
    void prepare(sim::OdeSystem&) override {}
    sim::Advance advance(sim::OdeSystem&, double, double, std::int64_t, const double*,
                         double*) override {
      return {sim::StepStatus::kDone, 1};
    }
  };
  sim::Registry registry = make_registry();
  sim::Simulation simulation(make_row(), registry);
  const auto spectrum = sim::study::spectrum(simulation);
  CHECK_FALSE(sim::study::predicted_step(Silent(), spectrum).has_value());
}

TEST_CASE("the largest stable step of a radius") {
  const auto limit = [](auto radius) {
    return sim::study::largest_stable_step(radius, 1, 0, 1e-9);
  };
  CHECK(limit([](double h) { return h < 2.5 ? 0.9 : 1.1; }) == Approx(2.5).epsilon(1e-5));
  CHECK(limit([](double) { return 1.0; }) == HUGE_VAL);
  CHECK(limit([](double h) { return 1 + h * h; }) == 0);
  CHECK(limit([](double h) { return 1 + std::pow(h, 4); }) == 0);  // not the tolerance's doing
  // The first of two intervals of stability counts.
  CHECK(limit([](double h) { return h < 1 || (h > 2 && h < 3) ? 0.5 : 2.0; }) ==
        Approx(1).epsilon(1e-5));
}

TEST_CASE("a study ends when told to, and keeps what it has") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_cloth(4);
  int calls = 0;
  const auto study = sim::study::stability({&spec, &registry}, {},
                                           [&](std::string_view, double) { return ++calls < 3; });
  CHECK_FALSE(study.complete);
  CHECK(study.methods.size() == 2);
  CHECK(study.spectrum.fastest.omega > 0);
}

TEST_CASE("a study ends when told to within the steps of one method") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_cloth(4);
  int calls = 0;
  const auto study =
      sim::study::stability({&spec, &registry}, {.integrators = {{"implicit_euler"}}},
                            [&](std::string_view, double) { return ++calls < 3; });
  CHECK_FALSE(study.complete);
  REQUIRE(study.methods.size() == 1);
  CHECK_FALSE(study.methods.front().measured.has_value());
  CHECK(calls < 10);
}

// The energies are those of runs with 1/4, 1/2, 0.9 of the limit and so on, of each method in turn.
TEST_CASE("a study ends when told to within its energies, and keeps those before") {
  sim::Registry registry = make_registry();
  sim::SystemSpec particles = make_elastic_pendulum(), numbers = make_circle();
  for (sim::SystemSpec* const spec : {&particles, &numbers}) {
    CAPTURE(spec->name);
    spec->duration = 2;
    const sim::study::StabilityOptions options{.integrators = {{"rk4"}, {"rk3"}}};
    std::vector<std::size_t> counts;
    for (int last = 0;; ++last) {
      int asked = 0;
      const auto study =
          sim::study::stability({spec, &registry}, options, [&](std::string_view what, double) {
            return !what.ends_with(", energy") || ++asked <= last;
          });
      REQUIRE(study.methods.size() == 2);
      counts.push_back(study.methods[0].energy.size() + study.methods[1].energy.size());
      if (study.complete) break;
      CHECK(asked > last);
      for (const MethodStability& each : study.methods)
        for (const auto& point : each.energy) CHECK(point.error >= 0);  // a number
      CHECK(asked == last + 1);                                         // not asked again
      if (counts.back() < 8 && last > 60) last += last / 2;
    }
    CHECK(counts.front() == 0);
    CHECK(counts.back() == 8);
    CHECK(std::ranges::is_sorted(counts));
  }
}

TEST_CASE("unknown and unfitting integrators are refused by name") {
  CHECK_THROWS_AS(study_of(make_row(), {{"rk5"}}), sim::Error);
  CHECK_THROWS_AS(study_of(make_circle(), {{"verlet"}}), sim::Error);
}
