// The verdict on runs of which it is known how far they can be trusted.
#include "core/study/verdict/verdict.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "core/lua/scene/scene_file.h"
#include "core/study/limits/spectrum.h"
#include "core/study/limits/step_limit.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::Trust;
using sim::study::Verdict;

namespace {

// Runs to `time` as sim does, with a look now and then.
Verdict verdict_of(const sim::SystemSpec& spec, const std::string& integrator, double dt,
                   double time, int looks = 100) {
  sim::Registry registry = make_registry();
  sim::Simulation simulation(spec, registry, {.integrator = integrator, .dt = dt});
  const std::int64_t steps = simulation.steps_for(time);
  sim::study::Monitor monitor(spec, simulation, steps, &registry);
  const std::int64_t stride = std::max<std::int64_t>(1, steps / looks);
  for (std::int64_t i = 0; i <= steps; ++i) {
    if (i > 0) {
      REQUIRE(simulation.step());
      monitor.advance();
    }
    if (i % stride != 0 && i != steps) continue;
    const sim::Energy energy = simulation.energy();
    monitor.look(&energy);
  }
  return monitor.verdict();
}

std::string text(const Verdict& verdict) {
  return std::string(sim::study::trust_name(verdict.trust)) + ": " + verdict.reason;
}

}  // namespace

TEST_CASE("the verdict on the cloth with drag") {
  const sim::SystemSpec cloth = make_cloth(8);
  CHECK(verdict_of(cloth, "euler", 0.005, 2).trust == Trust::kDiverged);
  for (const auto& [integrator, dt] :
       {std::pair{"rk4", 0.005}, {"trapezoid", 0.001}, {"verlet", 0.005}, {"pefrl", 0.01}}) {
    const Verdict verdict = verdict_of(cloth, integrator, dt, 2);
    INFO(integrator << ' ' << dt << ' ' << text(verdict));
    CHECK(verdict.trust == Trust::kTrusted);
    CHECK(verdict.figures.energy < 0.01);
    CHECK(verdict.figures.dt_share < 1);
    CHECK(std::abs(verdict.figures.strain.strain) < 0.5);
    CHECK(verdict.figures.step_error < 1e-4);
  }
}

// Nothing explodes: drag takes what the unstable mode gains. Only the balance shows it, or the
// step.
TEST_CASE("rk4 just above its limit is suspect, and wrong by 100 % in energy") {
  for (const double dt : {0.0149, 0.0155, 0.016}) {
    const Verdict verdict = verdict_of(make_cloth(8), "rk4", dt, 2);
    INFO(dt << ' ' << text(verdict));
    CHECK(verdict.trust == Trust::kSuspect);
    CHECK(verdict.figures.dt_share > 1);
  }
  CHECK(verdict_of(make_cloth(8), "rk4", 0.0155, 2).figures.energy > 1);
}

// A bead of 1 g with a drag of 1000 1/s beside a weight that swings with 100 rad/s.
TEST_CASE("the limit of dt is that of what decays fastest, too") {
  sim::SystemSpec spec = make_chain({{0, 0, 0}, {0.3, 0, 0}}, {0}, 0);
  spec.particles->list[1].mass = 0.04;
  spec.particles->list.push_back({.position = {0, 1, 0}, .velocity = {0.1, 0, 0}, .mass = 1e-3});
  sim::PartSpec all = make_drag(1), one = make_drag(1);
  one.particles = std::vector<int>{2};
  const auto share = [&](const sim::PartSpec& drag, const std::string& integrator, double dt) {
    sim::SystemSpec dragged = spec;
    dragged.forces.push_back(drag);
    return verdict_of(dragged, integrator, dt, 200 * dt).figures.dt_share;
  };
  CHECK(share(all, "rk4", 0.97 * 2.785e-3) == Approx(0.97).epsilon(0.02));
  CHECK(share(one, "rk4", 0.97 * 2.785e-3) == Approx(0.97).epsilon(0.02));
  CHECK(share(one, "verlet", 0.97 * 4e-3) == Approx(0.97).epsilon(0.02));
  CHECK(share(all, "verlet", 0.97 * 4e-3) < 0.3);  // which is exact there
}

TEST_CASE("a run without drag near the limit is not trusted") {
  const sim::SystemSpec cloth = make_cloth(8, {.drag = 0});
  CHECK(verdict_of(cloth, "rk4", 0.9 * 0.01468, 2).trust != Trust::kTrusted);
  CHECK(verdict_of(cloth, "verlet", 0.9 * 0.01038, 2).trust != Trust::kTrusted);
  CHECK(verdict_of(cloth, "pefrl", 0.002, 2).trust == Trust::kTrusted);
}

TEST_CASE("a method without a stable step is suspect when its growth shows") {
  const sim::SystemSpec pendulum = make_elastic_pendulum();
  const Verdict slow = verdict_of(pendulum, "trapezoid", 0.002, 2);
  CHECK(slow.trust == Trust::kTrusted);
  CHECK(slow.figures.dt_share > 1);
  // |R(i z)|^2 = 1 + z^4/4 for the explicit trapezoidal rule: 1000 steps grow by e^(125 z^4).
  INFO(text(slow));
  const double z = std::pow(slow.figures.growth / 125, 0.25);
  const std::string words = "but in this run the fastest mode grows by no more than ";
  const auto at = slow.reason.find(words);
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(slow.reason.substr(at + words.size())) ==
        Approx(100 * std::expm1(125 * std::pow(z, 4))).epsilon(0.06));
  CHECK(verdict_of(pendulum, "euler", 0.002, 2).trust == Trust::kSuspect);
}

TEST_CASE("long runs and few looks change no verdict") {
  for (const double time : {0.05, 2.0, 200.0})
    for (const int looks : {3, 20, 100}) {
      const Verdict verdict = verdict_of(make_cloth(4), "rk4", 0.005, time, looks);
      INFO(time << ' ' << looks << ' ' << text(verdict));
      CHECK(verdict.trust == Trust::kTrusted);
    }
}

TEST_CASE("energy that is lost is found, with drag and without") {
  // Long steps of RK4 take energy out of the spring.
  CHECK(verdict_of(make_elastic_pendulum(), "rk4", 0.2, 40).trust == Trust::kSuspect);
  CHECK(verdict_of(make_elastic_pendulum(0.01), "rk4", 0.2, 40).trust == Trust::kSuspect);
}

TEST_CASE("the work of drag is the same from several steps at once") {
  sim::Registry registry = make_registry();
  for (const int n : {8, 130}) {  // the larger one is not looked at after every step
    const sim::RunOptions options{.integrator = "verlet", .dt = 1e-4};
    sim::Simulation one(make_cloth(n), registry, options), many(make_cloth(n), registry, options);
    sim::study::EnergyBalance single(one), several(many);
    for (int i = 0; i < 100; ++i) {
      REQUIRE(one.step());
      single.advance();
    }
    for (int left = 100, most = 1; left > 0; most = most % 5 + 1) {
      const int taken = many.steps(std::min<std::int64_t>({left, most, several.due()}));
      REQUIRE(taken > 0);
      several.advance(taken);
      left -= taken;
    }
    CHECK(single.taken() > 0);
    CHECK(several.taken() == single.taken());
    CHECK(several.uncertainty() == single.uncertainty());
    CHECK(several.due() == single.due());
    CHECK(single.due() == (n == 8 ? 1 : 4));  // every eighth step
  }
}

// x' = i x: one step multiplies by the polynomial R(i h), and two of half the size by R(i h/2)^2.
TEST_CASE("the error of a step is what doubling it shows, as if it were all of the error") {
  using Complex = std::complex<double>;
  const auto r = [](int order, double h) {
    Complex sum = 1, term = 1;
    for (int k = 1; k <= order; ++k) sum += term *= Complex(0, h) / double(k);
    return sum;
  };
  for (const auto& [method, order] : {std::pair{"euler", 1}, {"rk3", 3}, {"rk4", 4}}) {
    INFO(method);
    sim::Registry registry = make_registry();
    const sim::SystemSpec circle = make_circle();
    const double h = 0.1;
    sim::Simulation simulation(circle, registry, {.integrator = method, .dt = h});
    sim::study::Monitor monitor(circle, simulation, 299, &registry);  // one doubled step
    REQUIRE(run(simulation, 1));
    monitor.look(nullptr);
    const Complex off = r(order, h) * (r(order, h) - r(order, h / 2) * r(order, h / 2));
    const double most = std::max(std::abs(off.real()), std::abs(off.imag()));
    CHECK(monitor.verdict().figures.step_error ==
          Approx(most / (1 - std::pow(2.0, -order))).epsilon(1e-6));
  }
}

TEST_CASE("what is unknown of the work of drag counts as an error of the energy") {
  const sim::SystemSpec falling = make_falling(2, 1.5);
  sim::Registry registry = make_registry();
  sim::Simulation simulation(falling, registry, {.integrator = "rk4", .dt = 0.1});
  sim::study::Monitor monitor(falling, simulation, 30, &registry);
  sim::study::EnergyBalance balance(simulation);
  sim::study::WorkIntegral work;
  const auto look = [&] {  // power = c v^2
    work.look(simulation.t(), 1.5 * simulation.velocity(0).squaredNorm());
  };
  look();
  for (int i = 0; i <= 30; ++i) {
    if (i > 0) {
      REQUIRE(simulation.step());
      monitor.advance();
      balance.advance();
      look();
    }
    const sim::Energy energy = simulation.energy();
    monitor.look(&energy);
    if (i > 0) balance.look(energy);
  }
  CHECK(work.uncertainty() > 1e-9);
  CHECK(balance.uncertainty() == Approx(work.uncertainty()).epsilon(1e-6));
  CHECK(monitor.verdict().figures.energy ==
        Approx((std::abs(balance.error()) + work.uncertainty()) / balance.in_play()).epsilon(1e-9));
}

TEST_CASE("momentum holds where nothing holds the particles") {
  sim::SystemSpec spec = make_row(3, 0.1);
  spec.particles->pinned.clear();
  spec.particles->list[2].velocity = {1, 2, 3};
  spec.forces.push_back(make_gravity());
  const Verdict verdict = verdict_of(spec, "rk4", 0.002, 1);
  INFO(text(verdict));
  CHECK(verdict.trust == Trust::kTrusted);
  CHECK(verdict.figures.momentum < 1e-12);
  CHECK(std::isnan(verdict_of(make_row(3, 0.1), "rk4", 0.002, 1).figures.momentum));
}

TEST_CASE("a force that is not what its potential gives is named at the start") {
  sim::Registry registry = make_registry();
  registry.load(SIM_FIXTURE_DIR "/broken_forces/broken_forces.so");
  const auto judged = [&](const std::string& force) {
    sim::SystemSpec spec = make_row(2, 0.1);
    spec.forces = {make_part(force)};
    sim::Simulation simulation(spec, registry, {.integrator = "rk4", .dt = 0.001});
    sim::study::Monitor monitor(spec, simulation, 100, &registry);
    const sim::Energy energy = simulation.energy();
    monitor.look(&energy);
    return monitor.verdict();
  };
  const Verdict wrong = judged("wrong_potential");  // by 1 %
  INFO(text(wrong));
  CHECK(wrong.trust == Trust::kSuspect);
  CHECK(
      wrong.reason.find("force 'wrong_potential' is not what its potential gives: on particle ") !=
      std::string::npos);
  CHECK(judged("wrong_jacobian").reason.find("potential") == std::string::npos);
}

TEST_CASE("forces of ties, pairs and surfaces are what their potentials give, also in a lattice") {
  sim::Registry registry = make_registry();
  for (const std::string file : {"gas", "jelly", "double_well"}) {
    const sim::SceneSpec scene =
        sim::load_scene("scenes/" + file + ".lua", registry, {{SIM_SOURCE_DIR "/scripts"}, {}});
    const sim::SystemSpec& spec = scene.systems.front();
    sim::Simulation simulation(spec, registry);
    sim::study::Monitor monitor(spec, simulation, 1000, &registry);
    const sim::Energy energy = simulation.energy();
    monitor.look(&energy);
    CHECK(monitor.verdict().reason.find("potential gives") == std::string::npos);
  }
}

TEST_CASE("the worst spring is found in runs and nets, stretched and pressed") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_row();
  spec.particles->list[4].position.x() = 4.4;
  spec.particles->list[5].position.x() = 5.3;
  sim::Simulation stretched(spec, registry);
  const auto worst = sim::study::worst_spring(stretched);
  CHECK(worst.a == 3);
  CHECK(worst.b == 4);
  CHECK(worst.strain == Approx(0.4));
  CHECK(sim::study::family_of(stretched, 3, 4) == "link");
  spec.forces.front().elements.add({0, 9}, {{"rest", 10}});
  spec.forces.front().elements.add({1, 8}, {{"rest", 70}});
  sim::Simulation pressed(spec, registry);
  CHECK(sim::study::worst_spring(pressed).strain == Approx(-0.9));
  spec.forces.clear();
  sim::Simulation none(spec, registry);
  CHECK(sim::study::worst_spring(none).a == -1);
}

TEST_CASE("a few products know the fastest vibration, and the bound is above it") {
  sim::Registry registry = make_registry();
  sim::Simulation cloth(make_cloth(8), registry);
  const auto quick = sim::study::fastest_vibration(cloth, 6);
  CHECK(quick.omega == Approx(192.678).epsilon(2e-3));
  CHECK(quick.omega <= 192.679);
  CHECK(quick.damping == Approx(2).epsilon(1e-6));
  CHECK(sim::study::smallest_damping(cloth) == Approx(2));
  CHECK(sim::study::omega_bound(cloth) > 192.678);
  const auto share = [&](double h) {
    return sim::study::step_share(cloth.integrator(), {192.678, 2}, h).share;
  };
  CHECK(share(0.005) == Approx(0.005 / 1.474e-2).epsilon(0.01));
  CHECK(share(0.05) == Approx(0.05 / 1.474e-2).epsilon(0.01));
}

// A potential cut off without smoothing jumps at the cutoff, which no force shows.
TEST_CASE("energy that no step keeps is blamed on the forces") {
  const auto gas = [](const std::string& smooth) {
    sim::SystemSpec spec = make_falling(1, 0);
    spec.particles->list.clear();
    for (int i = 0; i < 64; ++i) {
      const sim::Vec3 at(i % 4, i / 4 % 4, i / 16);
      const sim::Vec3 v(std::sin(i), std::sin(2 * i), std::sin(3 * i));
      spec.particles->list.push_back({.position = 1.2 * at, .velocity = v, .mass = 1});
    }
    spec.forces = {make_part("pair", {{"smooth", smooth}})};
    return spec;
  };
  const auto words = [&](const std::string& smooth, double dt, double drag = 0) {
    sim::SystemSpec spec = gas(smooth);
    if (drag > 0) spec.forces.push_back(make_drag(drag));
    sim::Registry registry = make_registry();
    sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = dt});
    const std::int64_t steps = system.steps_for(2);
    sim::study::Monitor monitor(spec, system, steps, &registry);
    sim::study::StepDoubling shadow(spec, system, steps, registry);
    for (std::int64_t n = 0; n <= steps; ++n) {
      if (n > 0) {
        REQUIRE(system.step());
        monitor.advance();
      }
      const sim::Energy energy = system.energy();
      monitor.look(&energy);
      shadow.look(&energy);
    }
    return text(monitor.verdict(shadow.compare([] { return false; })));
  };
  const std::string cause = "no step mends it: some potential jumps";
  INFO(words("off", 0.005));
  CHECK(words("off", 0.005).find(cause) != std::string::npos);
  CHECK(words("energy", 0.005).find("energy to ") != std::string::npos);
  const std::string too_long = words("force", 0.03);
  INFO(too_long);
  CHECK(too_long.find("energy ") != std::string::npos);
  CHECK(too_long.find(cause) == std::string::npos);
  // Beside drag it is not known whose fault that is, and still one: steps are of one length.
  const std::string dragged = words("off", 0.005, 1e-3);
  INFO(dragged);
  CHECK(dragged.starts_with("suspect: "));
  CHECK(dragged.find("energy ") != std::string::npos);
  CHECK(dragged.find(" drag left") != std::string::npos);
}

TEST_CASE("what forces give to a particle at rest is no explosion") {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.forces = {make_part("expression", {{"fx", std::string("sin(5*t)")}})};
  const Verdict driven = verdict_of(spec, "verlet", 1e-4, 1);
  INFO(text(driven));
  CHECK(driven.trust == Trust::kTrusted);
  CHECK(driven.figures.energy < 1e-3);
}

// A spring whose end is led, and a particle that a slow ball meets: both begin at rest.
TEST_CASE("what motion that is given adds to a scene at rest is no explosion") {
  const std::string led =
      "local p = sim.particles { mass = 1 }\nlocal a, b = p:add {0, 0, 0}, p:add {1, 0, 0}\n"
      "p:prescribe(a, function(t) return {0.3*math.exp(-((t - 5)/0.8)^2), 0, 0} end)\n"
      "return sim.scene { particles = p, forces = { sim.force.spring { stiffness = 100, rest = 1,\n"
      "  ties = {{a, b}} } }, integrator = \"rk4\", dt = 0.01, duration = 10 }\n";
  const std::string pushed =
      "local p = sim.particles { mass = 1 }\np:add {0, 0, 0}\n"
      "local ball = sim.collider.sphere { radius = 0.5, center = {-0.5, 0, 0},\n"
      "  motion = function(t) return {-0.5 + 1e-2*t^6, 0, 0} end }\n"
      "return sim.scene { particles = p, colliders = {ball}, forces = {},\n"
      "  integrator = \"verlet\", dt = 0.01, duration = 3 }\n";
  for (const std::string& text : {led, pushed}) {
    const sim::SceneSpec scene = sim::test::load_text(text);
    sim::Registry registry = make_registry();
    sim::Simulation run(scene.systems[0], registry);
    const std::int64_t steps = run.steps_for(scene.systems[0].duration);
    sim::study::Monitor monitor(scene.systems[0], run, steps, &registry);
    for (std::int64_t n = 0; n < steps; ++n) {
      REQUIRE(run.step());
      monitor.advance();
      const sim::Energy energy = run.energy();
      monitor.look(&energy);
    }
    const Verdict verdict = monitor.verdict({});
    INFO(verdict.reason);
    CHECK(verdict.trust < Trust::kSuspect);
  }
}

// Looks are rare where they cost much. In free fall the kinetic energy is m (g t)^2/2 = 48.1 J.
TEST_CASE("a verdict is of the state that it is asked at, not of the last look") {
  const sim::SystemSpec spec = make_falling(1, 0);
  sim::Registry registry = make_registry();
  sim::Simulation system(spec, registry, {.integrator = "verlet", .dt = 0.01});
  sim::study::Monitor monitor(spec, system, 100, &registry);
  const sim::Energy start = system.energy();
  monitor.look(&start);
  CHECK(text(monitor.verdict()).find("hardly anything moves") != std::string::npos);
  REQUIRE(run(system, 100));
  monitor.advance(100);
  const std::string words = text(monitor.verdict());
  INFO(words);
  CHECK(words.find("hardly anything moves") == std::string::npos);
  CHECK(words.find("trusted: energy to ") == 0);
}

// The energy of a neo-Hookean cell is a sum of terms of mu, 3.4e4 Pa, that cancel at rest: what is
// left is rounding, some 1e-16 of mu times the volume of 2e-3 m^3.
TEST_CASE("a solid at rest without forces is at rest, though its energy is rounding") {
  const sim::SceneSpec scene = sim::test::load_text(
      "local bar = sim.grid { 5, 3, 3, du = {0.05, 0, 0}, dv = {0, 0.05, 0}, dw = {0, 0, 0.05} }\n"
      "return sim.scene { particles = bar, dt = 1e-4, forces = { sim.force.fem {\n"
      "  cells = sim.cells { grid = bar }, young = 1e5, poisson = 0.45, density = 900,\n"
      "  model = 'neo_hookean' } }, integrator = 'verlet', duration = 1 }");
  const std::string words = text(verdict_of(scene.systems.front(), "verlet", 1e-4, 0.1));
  INFO(words);
  CHECK(words.find("trusted: hardly anything moves") == 0);
}

// A jelly of 5 kPa and 1000 kg/m^3 of 0.6 m height bears 5.9 kPa at its foot.
TEST_CASE("a body that its own weight crushes is not trusted, a stiff one is") {
  const auto judged = [](double young) {
    const sim::SceneSpec scene = sim::test::load_text(
        "local block = sim.grid { 4, 4, 4, origin = {0, 0.001, 0}, du = {0.2, 0, 0},\n"
        "  dv = {0, 0.2, 0}, dw = {0, 0, 0.2} }\n"
        "return sim.scene { particles = block, forces = { sim.force.gravity {}, sim.force.fem {\n"
        "  cells = sim.cells { grid = block }, poisson = 0.3, density = 1000, young = " +
        std::to_string(young) +
        " }, sim.force.drag { k = 5 } },\n"
        "  colliders = { sim.collider.plane { normal = {0, 1, 0} } },\n"
        "  integrator = 'verlet', dt = 2e-4, duration = 1 }");
    return verdict_of(scene.systems.front(), "verlet", 2e-4, 1);
  };
  const Verdict soft = judged(5e3), stiff = judged(1e6);
  INFO(text(soft));
  CHECK(soft.trust == Trust::kSuspect);
  INFO(text(stiff));
  CHECK(stiff.reason.find("cells stretched by ") != std::string::npos);
  CHECK(stiff.figures.cells.least > 0.95);
  CHECK(stiff.figures.cells.volume > 0.95);
}

// x'' = sin(w t) from rest: v = (1 - cos(w t)) / w, so that its power has frequencies up to 2 w.
TEST_CASE("the work of a force of time is known as well as the steps allow, and no dearer") {
  sim::SystemSpec spec = make_falling(1, 0);
  const auto force = [&](double w) {
    spec.forces = {make_part("expression", {{"fx", "sin(" + std::to_string(w) + "*t)"}})};
  };
  force(10);
  const Verdict driven = verdict_of(spec, "rk4", 0.005, 60);
  INFO(text(driven));
  CHECK(driven.trust == Trust::kTrusted);
  CHECK(driven.reason.find("energy to ") != std::string::npos);
  CHECK(driven.figures.energy < 1e-3);

  const auto looks = [&](double w) {
    force(w);
    sim::Registry registry = make_registry();
    sim::Simulation system(spec, registry, {.integrator = "rk4", .dt = 0.005});
    sim::study::EnergyBalance balance(system, 12000);
    int count = 0;
    while (system.step_count() < 12000) {
      const auto steps = std::min<std::int64_t>(balance.due(), 12000 - system.step_count());
      REQUIRE(run(system, steps));
      balance.advance(steps);
      if (system.step_count() % 120 < steps) balance.look();
      ++count;
    }
    CHECK(balance.uncertainty() < 1e-3 * balance.in_play());
    // All that is in play was given by the force: E(t) = W(t) = v(t)^2 / 2.
    CHECK(std::abs(balance.error()) < 1e-3 * balance.in_play());
    return count;
  };
  CHECK(looks(0.5) < 1200);  // 2 % of four evaluations a step are one in 12 steps
  CHECK(looks(10) > 3000);
}

// Its modes grow for a moment and shrink again as it moves; no step would change that.
TEST_CASE("a mechanism that moves is not said to need another step") {
  const std::string file = std::string(SIM_SOURCE_DIR) + "/scripts/scenes/linkage.lua";
  const sim::SystemSpec spec = sim::test::load(file).systems[0];
  const Verdict verdict = verdict_of(spec, "rk4", spec.dt, spec.duration);
  INFO(text(verdict));
  CHECK(verdict.reason.find("no dt near this one is stable") == std::string::npos);
  CHECK(verdict.figures.dt_share < 1);
}
