// Steps that are implicit in stiff forces alone.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/error.h"
#include "core/ode/fastest_mode.h"
#include "core/ode/integrator.h"
#include "core/session/checkpoint.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Vec3;

namespace {

// The last row of a cloth is tied by stiffer springs.
sim::SystemSpec make_seam(int n, double stiffness, double drag = 2) {
  sim::SystemSpec spec = make_cloth(n, {.drag = drag});
  sim::PartSpec seam = make_springs("seam", stiffness);
  for (int j = 0; j + 1 < n; ++j) seam.elements.add({(n - 1) * n + j, (n - 1) * n + j + 1});
  spec.forces.push_back(seam);
  return spec;
}

// A particle of 2 kg between a soft and a stiff spring to pinned ones, both without length.
sim::SystemSpec make_two_springs(double soft, double stiff) {
  sim::SystemSpec spec = make_falling(2, 0);
  spec.particles->list = {{.position = {0, 0, 0}},
                          {.position = {1, 0.5, -0.2}, .velocity = {0.3, -1, 2}, .mass = 2},
                          {.position = {0, 2, 0}}};
  spec.particles->pinned = {0, 2};
  spec.forces = {make_gravity()};
  for (const double k : {soft, stiff}) {
    sim::PartSpec spring = make_springs("spring", k);
    spring.given["rest"] = 0.0;
    spring.elements.add({1, k == soft ? 0 : 2});
    spec.forces.push_back(spring);
  }
  return spec;
}

// A bob on a stiff rod, and a second one on a soft spring from it.
sim::SystemSpec make_stiff_pendulum(double stiffness) {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list = {
      {.position = {0, 0, 0}}, {.position = {0.8, -0.6, 0}}, {.position = {1.3, -0.6, 0}}};
  spec.particles->pinned = {0};
  sim::PartSpec rod = make_springs("rod", stiffness), spring = make_springs("spring", 50);
  rod.elements.add({0, 1});
  spring.elements.add({1, 2});
  spec.forces = {make_gravity(), rod, spring};
  return spec;
}

double error_at_end(const sim::SystemSpec& spec, sim::Registry& registry, const char* method,
                    double time, int steps, const sim::Simulation& exact) {
  sim::Simulation system(spec, registry, {.integrator = method, .dt = time / steps});
  REQUIRE(run(system, steps));
  double most = 0;
  for (int i = 0; i < system.particles(); ++i)
    most = std::max(most, (system.position(i) - exact.position(i)).norm());
  return most;
}

double soft_omega(const sim::Simulation& system) {
  return sim::fastest_mode(*system.integrator().limiting_part(), 0, system.state().data()).rate;
}

std::string first_note(const sim::Simulation& system) {
  const std::vector<std::string> notes = system.integrator().notes();
  return notes.empty() ? "" : notes.front();
}

}  // namespace

TEST_CASE("imex has the bits of verlet where nothing is stiff") {
  sim::Registry registry = make_registry();
  sim::SystemSpec lands = make_cloth(6);
  lands.colliders = {make_part("plane", {{"point", Vec3(0, -0.3, 0)}})};
  for (const sim::SystemSpec& spec : {make_cloth(8), make_cloth(8, {.drag = 0}), lands}) {
    sim::Simulation imex(spec, registry, {.integrator = "imex", .dt = 0.002});
    sim::Simulation verlet(spec, registry, {.integrator = "verlet", .dt = 0.002});
    REQUIRE(run(imex, 300));
    REQUIRE(run(verlet, 300));
    CHECK(same_bits(state_of(imex), state_of(verlet)));
    CHECK(imex.integrator().limiting_part() == nullptr);
  }
}

TEST_CASE("imex counts the evaluations of verlet where nothing is stiff") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_cloth(4);
  for (const char* force : {"0.1", "-0.1*vx"}) {
    INFO(force);
    spec.forces.push_back(make_part("expression", {{"fx", std::string(force)}}));
    sim::Simulation own(spec, registry, {.integrator = "imex"});
    sim::Simulation verlet(spec, registry, {.integrator = "verlet"});
    REQUIRE(run(own, 10));
    REQUIRE(run(verlet, 10));
    const auto counted = own.integrator().effort().evaluations;
    CHECK(counted == Approx(verlet.integrator().effort().evaluations).margin(1));  // the first
    CHECK(counted == Approx(force[0] == '-' ? 40 : 10).margin(1));
  }
}

TEST_CASE("imex finds the springs of a stiff seam and no others") {
  sim::Registry registry = make_registry();
  const double h = 0.004;
  for (const double stiffness : {1e4, 1e6}) {
    sim::Simulation system(make_seam(8, stiffness), registry, {.integrator = "imex", .dt = h});
    CHECK(first_note(system).find("7 of 313 springs on 8 of 64 particles") != std::string::npos);
    // The soft part is the cloth without its seam, and limits the step.
    sim::Simulation soft(make_cloth(8), registry, {.integrator = "verlet", .dt = h});
    CHECK(soft_omega(system) ==
          Approx(sim::fastest_mode(soft.ode(), 0, soft.state().data()).rate).epsilon(0.02));
  }
}

TEST_CASE("imex leaves soft springs between stiff chains explicit, but not between stiff trusses") {
  sim::Registry registry = make_registry();
  constexpr int kKnots = 4;
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list.resize(2 * kKnots);
  sim::PartSpec masts = make_springs("mast", 1e6), cables = make_springs("cable", 200);
  for (int k = 0; k < kKnots; ++k)
    for (const int mast : {0, 1}) {
      spec.particles->list[static_cast<std::size_t>(mast * kKnots + k)].position = {
          1.0 * mast, 0.25 * k, 0};
      if (k > 0) masts.elements.add({mast * kKnots + k - 1, mast * kKnots + k});
    }
  spec.particles->pinned = {0, kKnots};
  cables.elements.add({kKnots - 1, 2 * kKnots - 1});
  cables.elements.add({kKnots - 2, 2 * kKnots - 2});
  spec.forces = {make_gravity(), masts, cables};
  const sim::RunOptions options{.integrator = "imex", .dt = 0.005};
  const sim::Simulation chains(spec, registry, options);
  CHECK(first_note(chains).find("6 of 8 springs on 8 of 8 particles") != std::string::npos);

  for (const int mast : {0, 1})
    for (int k = 2; k < kKnots; ++k)
      spec.forces[1].elements.add({mast * kKnots + k - 2, mast * kKnots + k});
  const sim::Simulation trusses(spec, registry, options);
  CHECK(first_note(trusses).find("12 of 12 springs") != std::string::npos);
}

TEST_CASE("a scene says which forces imex takes implicitly") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_seam(8, 1e6);
  spec.forces.back().stiff = false;
  sim::Simulation explicit_seam(spec, registry, {.integrator = "imex", .dt = 0.004});
  CHECK(explicit_seam.integrator().limiting_part() == nullptr);
  CHECK_FALSE(run(explicit_seam, 2000));
  spec = make_cloth(8);
  spec.forces.back().stiff = true;
  sim::Simulation implicit_flex(spec, registry, {.integrator = "imex", .dt = 1e-4});
  CHECK(first_note(implicit_flex).find("96 of 306 springs") != std::string::npos);
}

// v += h/2 a_soft; v_mid = v + h/2 a_stiff(q + h/2 v_mid), linear in v_mid; v += h/2 a_soft.
TEST_CASE("steps of imex are those of the splitting of Stern and Grinspun") {
  sim::Registry registry = make_registry();
  const double soft = 30, stiff = 5e5, mass = 2, h = 0.02;
  sim::Simulation system(make_two_springs(soft, stiff), registry,
                         {.integrator = {"imex", {{"substeps", std::int64_t{1}}}}, .dt = h});
  const Vec3 g(0, -kGravity, 0), far(0, 2, 0);
  Vec3 q(1, 0.5, -0.2), v(0.3, -1, 2);
  const auto kick = [&] { v = v + 0.5 * h * (g - soft / mass * q); };
  for (int n = 0; n < 200; ++n) {
    kick();
    const double w = 0.5 * h * stiff / mass;
    const Vec3 middle = (v - w * (q - far)) / (1 + 0.5 * h * w);
    q = q + h * middle;
    v = 2 * middle - v;
    kick();
  }
  REQUIRE(run(system, 200));
  CHECK((system.position(1) - q).norm() < 1e-9);
  CHECK((system.velocity(1) - v).norm() < 1e-6);
}

TEST_CASE("imex is of order 2, with stiff springs, soft ones and drag") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_stiff_pendulum(400);
  spec.forces.push_back(make_drag(0.3));
  spec.forces[1].stiff = true;
  sim::Simulation exact(spec, registry, {.integrator = "rk4", .dt = 1e-4});
  REQUIRE(run(exact, 10000));
  const double coarse = error_at_end(spec, registry, "imex", 1, 200, exact);
  const double fine = error_at_end(spec, registry, "imex", 1, 1600, exact);
  INFO(coarse << " " << fine);
  CHECK(std::log2(coarse / fine) / 3 == Approx(2).margin(0.1));
}

TEST_CASE("where all is stiff and nothing drags imex has the bits of the implicit midpoint rule") {
  sim::Registry registry = make_registry();
  sim::SystemSpec lands = make_chain({{0, 0, 0}, {0.25, 0, 0}, {0.5, 0, 0}}, {0}, 0);
  lands.colliders = {make_part("plane", {{"point", Vec3(0, -0.3, 0)}})};
  for (sim::SystemSpec spec : {make_stiff_pendulum(1e4), make_cloth(6, {.drag = 0}), lands}) {
    for (sim::PartSpec& force : spec.forces)
      if (force.plugin == "spring") force.stiff = true;
    sim::Simulation imex(spec, registry, {.integrator = "imex", .dt = 0.005});
    sim::Simulation midpoint(spec, registry, {.integrator = "implicit_midpoint", .dt = 0.005});
    REQUIRE(run(imex, 200));
    REQUIRE(run(midpoint, 200));
    CHECK(same_bits(state_of(imex), state_of(midpoint)));
    CHECK(imex.integrator().effort().newton == midpoint.integrator().effort().newton);
  }
}

TEST_CASE("where all is stiff imex with drag is as close as the implicit midpoint rule") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_chain({{0, 0, 0}, {0.25, 0, 0}, {0.5, 0, 0}, {0.75, 0, 0}}, {0}, 0.1);
  for (sim::PartSpec& force : spec.forces)
    if (force.plugin == "spring") force.stiff = true;
  sim::Simulation exact(spec, registry, {.integrator = "rk4", .dt = 1e-4});
  REQUIRE(run(exact, 10000));
  const double imex = error_at_end(spec, registry, "imex", 1, 400, exact);
  const double midpoint = error_at_end(spec, registry, "implicit_midpoint", 1, 400, exact);
  INFO(imex << " " << midpoint);
  CHECK(imex < 1.5 * midpoint);
}

TEST_CASE("drag beside stiff springs is exact at any step size") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list = {{.position = {0, 0, 0}, .velocity = {3, 1, 0}},
                          {.position = {1, 0, 0}, .velocity = {3, 1, 0}}};
  sim::PartSpec rod = make_springs("rod", 1e8);
  rod.elements.add({0, 1});
  spec.forces = {make_gravity(), make_drag(6), rod};
  for (const double h : {0.01, 0.1, 1.0}) {
    sim::Simulation system(spec, registry, {.integrator = "imex", .dt = h});
    REQUIRE(run(system, 3));
    const double t = 3 * h, terminal = -kGravity / 6;
    for (const int i : {0, 1}) {
      INFO("h = " << h);
      CHECK(system.velocity(i).x() == Approx(3 * std::exp(-6 * t)).epsilon(1e-6).margin(1e-8));
      CHECK(system.velocity(i).y() ==
            Approx(terminal + (1 - terminal) * std::exp(-6 * t)).epsilon(1e-6));
    }
  }
}

TEST_CASE("a pendulum on a stiff rod keeps its energy over 1e5 steps of imex") {
  sim::Registry registry = make_registry();
  for (const double stiffness : {1e5, 1e8}) {
    sim::Simulation system(make_stiff_pendulum(stiffness), registry,
                           {.integrator = "imex", .dt = 0.002});
    const double start = system.energy().total();
    double kinetic = 0, early = 0, late = 0;
    for (int n = 0; n < 100000; ++n) {
      REQUIRE(system.step());
      kinetic = std::max(kinetic, system.energy().kinetic);
      (n < 10000 ? early : late) += system.energy().total() - start;
    }
    INFO(stiffness << ": " << early / 10000 << " and " << late / 90000 << " of " << kinetic);
    CHECK(std::fabs(late / 90000 - early / 10000) < 1e-3 * kinetic);
  }
}

// By the midpoint rule the seam gains energy as it folds: more than there is, at 1e6 N/m.
TEST_CASE("a stiff seam that folds keeps its energy in steps of imex") {
  sim::Registry registry = make_registry();
  for (const double stiffness : {1e4, 1e6, 1e8}) {
    sim::Simulation system(make_seam(8, stiffness, 0), registry,
                           {.integrator = "imex", .dt = 0.001});
    const double start = system.energy().total();
    double kinetic = 0, early = 0, late = 0;
    constexpr int kSteps = 20000, kEarly = 5000;
    for (int n = 0; n < kSteps; ++n) {
      REQUIRE(system.step());
      kinetic = std::max(kinetic, system.energy().kinetic);
      (n < kEarly ? early : late) += system.energy().total() - start;
    }
    INFO(stiffness << ": " << early / kEarly << " and " << late / (kSteps - kEarly) << " of "
                   << kinetic);
    CHECK(std::fabs(late / (kSteps - kEarly) - early / kEarly) < 1e-3 * kinetic);
  }
}

// At h omega = 200 and 2000. Damping by more than is critical leaves the velocity along the rod.
TEST_CASE("what rings along a very stiff rod dies away in steps of imex") {
  sim::Registry registry = make_registry();
  for (const double stiffness : {1e10, 1e12}) {
    sim::SystemSpec spec = make_stiff_pendulum(stiffness);
    spec.particles->list[1].velocity = {0.8, -0.6, 0};
    sim::Simulation system(spec, registry, {.integrator = "imex", .dt = 0.002});
    REQUIRE(run(system, 3000));
    const Vec3 along = system.position(1) / system.position(1).norm();
    INFO(stiffness);
    CHECK(std::fabs(along.dot(system.velocity(1))) < 0.1);
  }
}

TEST_CASE("a run of imex goes on from a snapshot with the same bits") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_seam(8, 1e6);
  sim::Simulation whole(spec, registry, {.integrator = "imex", .dt = 0.004});
  sim::Simulation other(spec, registry, {.integrator = "imex", .dt = 0.004});
  REQUIRE(run(whole, 150));
  other.restore(whole.snapshot());
  REQUIRE(run(whole, 150));
  REQUIRE(run(other, 150));
  CHECK(same_bits(state_of(whole), state_of(other)));
}

// The second number of the memory is the frequency from which on springs are stiff: one beyond all
// of them, or 0 where most are.
TEST_CASE("checkpoints of imex have finite numbers, also where nothing or all is stiff") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = make_cloth(8);
  for (const double dt : {0.004, 0.1}) {
    CAPTURE(dt);
    sim::Simulation whole(spec, registry, {.integrator = "imex", .dt = dt});
    sim::Simulation other(spec, registry, {.integrator = "imex", .dt = dt});
    REQUIRE(run(whole, 50));
    const sim::Checkpoint::System saved = sim::checkpoint(whole, spec, 0);
    REQUIRE(saved.memory.size() > 2);
    CHECK((saved.memory[1] == 0) == (dt == 0.1));
    sim::resume(other, spec, saved, registry);
    REQUIRE(run(whole, 50));
    REQUIRE(run(other, 50));
    CHECK(same_bits(state_of(whole), state_of(other)));
  }
}

TEST_CASE("stiff dashpots are implicit with their springs") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_stiff_pendulum(1e5);
  spec.forces[1].given["damping"] = 3e3;
  sim::Simulation fine(spec, registry, {.integrator = "trbdf2", .dt = 1e-4});
  REQUIRE(run(fine, 5000));
  sim::Simulation system(spec, registry, {.integrator = "imex", .dt = 0.005});
  REQUIRE(run(system, 100));
  for (const int i : {1, 2}) CHECK((system.position(i) - fine.position(i)).norm() < 2e-3);
}

TEST_CASE("what imex holds stiffly lands on colliders and lies there") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list = {{.position = {0, 0.3, 0}}, {.position = {1, 0.5, 0}}};
  sim::PartSpec rod = make_springs("rod", 1e6);
  rod.elements.add({0, 1});
  spec.forces = {make_gravity(), make_drag(1), rod};
  spec.colliders = {make_part("plane", {{"friction", 0.3}})};
  sim::Simulation system(spec, registry, {.integrator = "imex", .dt = 0.005});
  for (int n = 0; n < 1000; ++n) {
    REQUIRE(system.step());
    for (const int i : {0, 1}) REQUIRE(system.position(i).y() > -1e-9);
  }
  for (const int i : {0, 1}) {
    CHECK(system.position(i).y() == Approx(0).margin(1e-9));
    CHECK(system.velocity(i).norm() < 1e-6);
  }
}

TEST_CASE("imex refuses constraints and first-order scenes, and says what to use") {
  sim::Registry registry = make_registry();
  sim::SystemSpec held = make_stiff_pendulum(100);
  sim::PartSpec rod = make_part("distance");
  rod.elements.add({0, 1});
  held.constraints = {rod};
  CHECK_THROWS_WITH(sim::Simulation(held, registry, {.integrator = "imex"}),
                    Catch::Contains("constraints") && Catch::Contains("trbdf2"));
  CHECK_THROWS_WITH(sim::Simulation(make_circle(), registry, {.integrator = "imex"}),
                    Catch::Contains("first"));
}
