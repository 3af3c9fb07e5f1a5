// Forces that a scene writes as formulas.
#include <cmath>
#include <numbers>

#include "core/base/array.h"
#include "core/base/layout.h"
#include "core/particles/particle_system.h"
#include "core/scene/simulation.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

// A cloth of 6 x 6 with `springs` as its structural and shear springs.
std::string cloth(const std::string& springs, const std::string& integrator = "rk4") {
  return "local particles = sim.grid { 6, 6, du = {0, 0, 0.2}, dv = {0.2, 0, 0}, mass = 0.03 }\n"
         "particles:pin(0, 5)\n"
         "local offsets = { {0, 1}, {1, 0}, {1, 1}, {1, -1} }\n" +
         springs +
         "\nlocal forces = { sim.force.gravity {}, sim.force.drag { k = 0.05 }, springs }\n"
         "return sim.scene { particles = particles, forces = forces, integrator = '" +
         integrator + "', dt = 0.004, duration = 1 }\n";
}

// Four particles in general position, moving, the first one pinned, under one force.
std::string four(const std::string& force, const std::string& integrator = "rk4") {
  return "local function tied(force, ...)\n"
         "  for _, tie in ipairs { ... } do force:tie(tie[1], tie[2], tie[3]) end\n"
         "  return force\nend\n"
         "local particles = sim.particles { mass = 2 }\n"
         "particles:add({0, 0, 0})\n"
         "particles:add({0.5, 0.1, -0.2}, { velocity = {1, 0.4, 0.5} })\n"
         "particles:add({-0.3, 0.7, 0.9}, { velocity = {0, -1, 0.2}, mass = 3 })\n"
         "particles:add({0.2, 1.4, 0.3}, { velocity = {0.3, 0.1, -1} })\n"
         "particles:pin(0)\n"
         "return sim.scene { particles = particles, forces = { " +
         force + " }, integrator = '" + integrator + "', dt = 0.002, duration = 1 }\n";
}

Simulation compiled(const std::string& text, int threads = 1) {
  Registry registry({SIM_PLUGIN_DIR});
  return Simulation(load_text(text).systems[0], registry, {.threads = threads});
}

double largest_difference(const std::string& one, const std::string& other, int steps) {
  Simulation a = compiled(one), b = compiled(other);
  REQUIRE((sim_test::run(a, steps) && sim_test::run(b, steps)));
  const std::vector<double> at_a = sim_test::state_of(a), at_b = sim_test::state_of(b);
  double most = 0;
  for (std::size_t i = 0; i < at_a.size(); ++i) most = std::max(most, std::fabs(at_a[i] - at_b[i]));
  CHECK(a.energy().potential == Approx(b.energy().potential).epsilon(1e-10).margin(1e-12));
  return most;
}

std::string error_of(const std::string& text) {
  try {
    compiled(text);
  } catch (const Error& error) {
    CHECK(error.kind() == ErrorKind::kScene);
    CHECK(contains(error.what(), "scene.lua:"));
    return error.what();
  }
  return "no error";
}

const std::string kTie =
    "local springs = sim.force.expression { energy = '0.5*k*(r - rest)^2', "
    "k = 40, grid = particles, offsets = offsets }";

}  // namespace

TEST_CASE("springs as a formula move as springs", "[lua][expression]") {
  const std::string springs =
      "local springs = sim.force.spring { stiffness = 40, grid = particles, offsets = offsets }";
  for (const char* integrator : {"rk4", "verlet"}) {
    INFO(integrator);
    CHECK(largest_difference(cloth(kTie, integrator), cloth(springs, integrator), 200) < 1e-12);
  }
  // Another linear solver, to its tolerance.
  CHECK(largest_difference(cloth(kTie, "trbdf2"), cloth(springs, "trbdf2"), 200) < 1e-6);
}

TEST_CASE("ties give numbers of their own to a formula", "[lua][expression]") {
  const std::string formula =
      "local springs = sim.force.expression { '0.5*stiffness*(r - rest)^2', rest = 0.25 }\n"
      "for i = 0, 34 do springs:tie(i, i + 1, { stiffness = 30 + i, rest = i % 2 == 0 and 0.2 or "
      "nil "
      "}) end";
  const std::string springs =
      "local springs = sim.force.spring {}\n"
      "for i = 0, 34 do springs:tie(i, i + 1, { stiffness = 30 + i, rest = i % 2 == 0 and 0.2 or "
      "0.25 }) end";
  CHECK(largest_difference(cloth(formula), cloth(springs), 50) < 1e-12);
}

TEST_CASE("formulas of particles act as the forces they describe", "[lua][expression]") {
  CHECK(largest_difference(four("sim.force.expression { energy = 'm*g*y', g = 9.81 }"),
                           four("sim.force.gravity {}"), 300) < 1e-12);
  CHECK(largest_difference(four("sim.force.expression { fx = '-c*vx', fy = '-c*vy', "
                                "fz = '-c*vz', c = 0.7 }"),
                           four("sim.force.drag { k = 0.7 }"), 300) < 1e-12);
}

TEST_CASE("formulas see the time", "[lua][expression]") {
  // x'' = cos(w t) / m from rest: x = x0 + (1 - cos(w t)) / (m w^2), with the same v0 otherwise.
  Simulation moved = compiled(four("sim.force.expression { fx = 'cos(w*t)', w = 3 }"));
  Simulation free = compiled(four(""));
  REQUIRE((sim_test::run(moved, 400) && sim_test::run(free, 400)));
  const double t = moved.t();
  CHECK(moved.position(1).x() - free.position(1).x() ==
        Approx((1 - std::cos(3 * t)) / (2 * 9)).epsilon(1e-9));
  CHECK(moved.position(1).y() == free.position(1).y());
}

TEST_CASE("forces of formulas are slopes of their energy, and implicit steps know theirs",
          "[lua][expression]") {
  const char* const forces[] = {
      "sim.force.expression { 'a*(x^2 - 1)^2 + b*y^2*exp(-z) + sin(x*y*z)/m', a = 3, b = 0.5 }",
      "sim.force.expression { fx = 'y*z - vx^3', fy = 'tanh(x)*vz', fz = '-z*abs(vy)' }",
      "tied(sim.force.expression { '4*e*(s^12 - s^6); s = l/r', e = 0.1, l = 0.8 }, {0, 1}, "
      "{1, 2}, {2, 3}, {3, 1})",
      "tied(sim.force.expression { 'd*(1 - exp(-a*(r - rest*1.1)))^2', d = 2, a = 1.5 }, {0, 1}, "
      "{1, 2}, {2, 3})"};
  for (const char* force : forces) {
    INFO(force);
    Simulation simulation = compiled(four(force));
    const Layout layout(4);
    OdeSystem& system = simulation.ode();
    const std::size_t size = system.size();
    Array x(size), y(size), up(size), down(size), dx(size), product(size);
    std::ranges::copy(simulation.state(), x.data());
    const auto evaluate = [&](Array& derivative) {
      system.eval(0, Stage{x.data(), {}}, y.data(), derivative.data());
    };

    // m a = -dU/dx of the free particles, by differences of fourth order.
    const bool conservative = std::string(force).find("fx") == std::string::npos;
    evaluate(up);
    constexpr double h = 1e-3;
    for (int i = 1; conservative && i < 4; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const auto energy = [&](double s) {
          SystemSpec moved = load_text(four(force)).systems[0];
          moved.particles->list[static_cast<std::size_t>(i)].position[axis] += s;
          Registry registry({SIM_PLUGIN_DIR});
          // The length at the start is part of the force.
          if (contains(force, "rest")) {
            Simulation whole = compiled(four(force));
            std::vector<Vec3> at;
            for (int j = 0; j < 4; ++j) at.push_back(whole.position(j));
            at[static_cast<std::size_t>(i)][axis] += s;
            double sum = 0;
            for (int j = 0; j < 3; ++j) {
              const auto a = static_cast<std::size_t>(j), b = a + 1;
              const double rest = (whole.position(j) - whole.position(j + 1)).norm();
              const double e = 1 - std::exp(-1.5 * ((at[a] - at[b]).norm() - rest * 1.1));
              sum += 2 * e * e;
            }
            return sum;
          }
          return Simulation(moved, registry).energy().potential;
        };
        const double slope =
            (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h);
        const double mass = i == 2 ? 3 : 2;
        INFO(i << " " << axis);
        CHECK(mass * layout.block(up.data(), 3 + axis)[i] == Approx(-slope).epsilon(1e-6));
      }

    // J dx against differences of the derivative along dx.
    for (int block = 0; block < 6; ++block)
      for (int i = 1; i < 4; ++i) layout.block(dx.data(), block)[i] = std::sin(1.0 + i + 4 * block);
    const auto jacobian = system.jacobian();
    jacobian->at(0, x.data());
    jacobian->apply(dx.data(), product.data());
    constexpr double e = 1e-5;
    for (std::size_t k = 0; k < size; ++k) x[k] += e * dx[k];
    evaluate(up);
    for (std::size_t k = 0; k < size; ++k) x[k] -= 2 * e * dx[k];
    evaluate(down);
    for (int block = 3; block < 6; ++block)
      for (int i = 1; i < 4; ++i) {
        const double difference =
            (layout.block(up.data(), block)[i] - layout.block(down.data(), block)[i]) / (2 * e);
        CHECK(layout.block(product.data(), block)[i] ==
              Approx(difference).epsilon(1e-6).margin(1e-6));
      }
  }
}

TEST_CASE("a formula of velocities is refused by splitting methods of fourth order",
          "[lua][expression]") {
  CHECK_NOTHROW(compiled(four("sim.force.expression { 'x^2' }", "verlet")));
  CHECK_NOTHROW(compiled(four("sim.force.expression { fx = '-x' }", "pefrl")));
  CHECK_NOTHROW(compiled(four("sim.force.expression { fx = '-vx' }", "verlet")));
  CHECK(error_of(four("sim.force.expression { fx = '-vx' }", "pefrl")) != "no error");
}

TEST_CASE("ties without length and far apart have the force of a spring", "[lua][expression]") {
  const auto pair = [](const std::string& at, const std::string& energy) {
    Simulation simulation =
        compiled("local particles = sim.particles {}\nparticles:add {0, 0, 0}\nparticles:add " +
                 at + "\nparticles:pin(0)\nlocal forces = { sim.force.expression { '" + energy +
                 "' }:tie(0, 1) }\n" + kEnd);
    const bool went = simulation.step();
    return std::pair{went, simulation.velocity(1)};
  };
  CHECK(pair("{0, 0, 0}", "(r - 1)^2").second == Vec3::Zero());
  const auto [went, far] = pair("{3e200, 4e200, 0}", "0.5*r*1e-3");
  CHECK(went);
  CHECK(far.x() == Approx(-0.6e-5 * 0.5).epsilon(1e-9));
  CHECK(pair("{3e-200, 4e-200, 0}", "r").first);
  // An energy without a value at r = 0 is no force of 0.
  CHECK_FALSE(pair("{0, 0, 0}", "1/r").first);
}

TEST_CASE("a formula without a value stops the run, not the program", "[lua][expression]") {
  Simulation simulation = compiled(four("sim.force.expression { 'log(x + 0.2)' }"));
  CHECK_FALSE(simulation.step());
  CHECK(simulation.divergence().particle == 2);
  for (const double number : sim_test::state_of(simulation)) CHECK(std::isfinite(number));
}

TEST_CASE("formulas have the same bits for any number of threads", "[lua][expression]") {
  const std::string many =
      "local particles = sim.grid { 90, 60, du = {0, 0, 0.02}, dv = {0.02, 0, 0}, mass = 0.03 }\n"
      "particles:pin(0, 59)\nlocal forces = { sim.force.expression { '40*(r - rest)^2 + r^4', "
      "grid = particles, offsets = { {0, 1}, {1, 0} } }, sim.force.expression { "
      "'m*9.81*y + sin(x*9)*cos(z*7 + t)/50' } }\n" +
      kEnd;
  Simulation one = compiled(many), three = compiled(many, 3);
  REQUIRE((sim_test::run(one, 5) && sim_test::run(three, 5)));
  CHECK(one.hash() == three.hash());
  CHECK(one.energy().total() == three.energy().total());
}

TEST_CASE("mistakes in formulas name the line, the column and the name", "[lua][expression]") {
  const struct {
    const char* force;
    std::vector<const char*> says;
  } cases[] = {
      {"{ '0.5*k*(x-a)^2', k = 1 }", {"bad energy of a particle", "column 10", "'a' is not known"}},
      {"{ '0.5*k*x^2', k = 1, kk = 2 }", {"no formula of it reads 'kk'", "did you mean 'k'"}},
      {"{ '0.5*k*x^2', k = 'one' }", {"'k'"}},
      {"{ 'x^2', x = 2 }", {"'x' is a variable of it already"}},
      {"{ 'x*r^2' }", {"energy of a particle", "'r' is not known"}},
      {"{ 'r^2*q' }", {"energy of a pair", "'q' is not known"}},
      {"{ 'vx^2' }", {"'vx' is not known", "did you mean 'x'"}},
      {"{ enery = 'x^2' }", {"it has no parameter 'enery'", "did you mean 'energy'"}},
      {"{ k = 3 }", {"it has no formula"}},
      {"{ 'x', fx = 'x' }", {"an energy and a force"}},
      {"{ fx = 'x' }:tie(0, 1)", {"do not go with ties"}},
      {"{ 'x' }:tie(0, 1)", {"energy of a tie", "'x' is not known"}},
      {"{ 'stiffness*r' }:tie(0, 1, { stiffness = 3 }):tie(1, 2)", {"tie 2 gives no stiffness"}},
      {"{ 'r' }:tie(0, 1, { stiffness = 3 })", {"no formula of it reads 'stiffness'"}},
      {"{ 3 }", {"energy is 3"}},
      {"{ 'x^2', k = 0/0 }", {"k"}},
      {"{ string.rep('(', 100000) }", {"more than 10000 characters"}},
      {"{ string.rep('(', 9000) }", {"nested deeper"}},
      {"{ '1/k + x', k = 0 }", {"not finite"}},
  };
  for (const auto& [force, says] : cases) {
    const std::string message = error_of(four(std::string("sim.force.expression ") + force));
    INFO(force << " -> " << message);
    for (const char* part : says) CHECK(contains(message, part));
  }
}

TEST_CASE("a pair potential as a formula moves a gas as the one in the kernel",
          "[lua][expression]") {
  const auto gas = [](const std::string& force, const std::string& integrator) {
    return "local g = sim.grid { 5, 4, 4, du = {1.1, 0, 0}, dv = {0, 1.12, 0}, "
           "dw = {0.01, 0, 1.13}, mass = 1 }\n"
           "return sim.scene { particles = g, forces = { " +
           force + " }, integrator = '" + integrator + "', dt = 0.002, duration = 1 }";
  };
  const std::string formula =
      "sim.force.expression { '4*e*(s^12 - s^6); s = l/r', e = 2, l = 1, cutoff = 2, skin = 0.2 }";
  const std::string built_in =
      "sim.force.pair { 'lennard_jones', epsilon = 2, sigma = 1, cutoff = 2, smooth = 'off', "
      "skin = 0.2 }";
  CHECK(largest_difference(gas(formula, "verlet"), gas(built_in, "verlet"), 150) < 1e-11);
  const std::string powers =
      "sim.force.expression { '4*e*(l^12/r^12 - l^6/(r*r^5))', e = 2, l = 1, cutoff = 2 }";
  CHECK(largest_difference(gas(powers, "verlet"), gas(built_in, "verlet"), 150) < 1e-11);
  CHECK(largest_difference(gas(formula, "trbdf2"), gas(built_in, "trbdf2"), 20) < 1e-6);
  Simulation of_formula = compiled(gas(formula, "verlet"));
  CHECK(dynamic_cast<ParticleSystem&>(of_formula.ode()).forces().front()->conservative());

  // The same bits whatever the lists hold beyond the cutoff, and on two threads.
  Simulation wide = compiled(gas(formula, "verlet")),
             narrow = compiled(gas("sim.force.expression { '4*e*(s^12 - s^6); s = l/r', e = 2, l = "
                                   "1, cutoff = 2, skin = 0 }",
                                   "verlet"));
  REQUIRE((sim_test::run(wide, 60) && sim_test::run(narrow, 60)));
  CHECK(wide.hash() == narrow.hash());

  CHECK(contains(error_of(gas("sim.force.expression { 'r', cutoff = 0 }", "rk4")),
                 "its cutoff is 0"));
  CHECK(contains(error_of(gas("sim.force.expression { 'r', skin = 1 }", "rk4")),
                 "a skin, but no cutoff"));
  CHECK(contains(error_of(gas("sim.force.expression { fx = 'x', cutoff = 1 }", "rk4")),
                 "fx, fy and fz do not go with pairs"));
  CHECK(contains(error_of(gas("sim.force.expression { 'x*r', cutoff = 1 }", "rk4")),
                 "'x' is not known"));
}

namespace {

// Four charges of their own masses, one of them pinned and one without a charge.
std::string charges(const std::string& force) {
  return "local particles = sim.particles { mass = 2 }\n"
         "particles:add({0, 0, 0}, { charge = 2 })\n"
         "particles:add({0.5, 0.1, -0.2}, { charge = -1, velocity = {1, 0.4, 0.5} })\n"
         "particles:add({-0.3, 0.7, 0.9}, { mass = 3 })\n"
         "particles:add({0.2, 1.4, 0.3}, { charge = 0.5, velocity = {0.3, 0.1, -1} })\n"
         "particles:pin(0)\n"
         "return sim.scene { particles = particles, forces = { " +
         force + " }, integrator = 'rk4', dt = 0.002, duration = 1 }\n";
}

constexpr double kCharge[] = {2, -1, 0, 0.5}, kMasses[] = {2, 2, 3, 2};

// The accelerations of the scene at its start: one step of Euler, long enough to tell.
std::vector<Vec3> accelerations(const std::string& text) {
  Registry registry({SIM_PLUGIN_DIR});
  Simulation system(load_text(text).systems[0], registry,
                    {.integrator = MethodChoice{"euler"}, .dt = 1});
  std::vector<Vec3> list;
  for (int i = 0; i < system.particles(); ++i) list.push_back(-system.velocity(i));
  REQUIRE(system.step());
  for (int i = 0; i < system.particles(); ++i)
    list[static_cast<std::size_t>(i)] += system.velocity(i);
  return list;
}

}  // namespace

TEST_CASE("a formula of pairs without a cutoff acts between all of them", "[expression]") {
  // Coulomb's law and Newton's, in plain loops.
  const std::string text =
      charges("sim.force.expression { 'k*charge1*charge2/r - G*m1*m2/r', k = 3, G = 0.7 }");
  const SystemSpec spec = load_text(text).systems[0];
  const std::vector<Vec3> a = accelerations(text);
  for (std::size_t i = 1; i < 4; ++i) {
    Vec3 sum(0, 0, 0);
    for (std::size_t j = 0; j < 4; ++j) {
      if (i == j) continue;
      const Vec3 d = spec.particles->at(static_cast<int>(i)).position -
                     spec.particles->at(static_cast<int>(j)).position;
      const double r = d.norm();
      sum += (3 * kCharge[i] * kCharge[j] - 0.7 * kMasses[i] * kMasses[j]) / (r * r * r) * d;
    }
    CHECK((a[i] - sum / kMasses[i]).norm() < 1e-12 * sum.norm());
  }
  // Ties by hand between all of them do the same, with exact derivatives in an implicit method,
  // too.
  std::string ties =
      "sim.force.expression { 'k*charge1*charge2/r - G*m1*m2/r', k = 3, G = 0.7,\n"
      "  ties = { {0,1}, {0,2}, {0,3}, {1,2}, {1,3}, {2,3} } }";
  for (const char* method : {"rk4", "verlet", "implicit_midpoint"}) {
    CAPTURE(method);
    TextRun pairs(text, method, 1e-3), tied(charges(ties), method, 1e-3);
    const double start = pairs.system.energy().total();
    pairs.run_to(0.05);
    tied.run_to(0.05);
    for (int i = 0; i < 4; ++i)
      CHECK((pairs.system.position(i) - tied.system.position(i)).norm() < 1e-9);
    CHECK(pairs.system.energy().total() == Approx(start).epsilon(1e-3));
  }
}

TEST_CASE("pairs feel exactly opposite forces, whatever the formula", "[expression]") {
  const std::string text =
      "local particles = sim.particles { mass = 1, weight = 3 }\n"
      "for i = 1, 70 do particles:add({math.sin(i), math.cos(2 * i), math.sin(3 * i + 1)},\n"
      "  { weight = 1 + i % 7 / 3 }) end\n"
      "local forces = { sim.force.expression { 'weight1*weight2^2/(0.1 + r)' } }\n" +
      kEnd;
  Vec3 sum(0, 0, 0);
  double most = 0;
  for (const Vec3& a : accelerations(text)) {
    sum += a;
    most = std::max(most, a.norm());
  }
  CHECK(most > 100);
  CHECK(sum.norm() < 1e-12 * most);
  // The same bits on any number of threads.
  TextRun one(text, "verlet", 1e-3), three(text, "verlet", 1e-3, 3);
  one.run_to(0.05);
  three.run_to(0.05);
  CHECK(one.system.hash() == three.system.hash());
}

TEST_CASE("a formula of pairs is nothing for one particle", "[expression]") {
  const std::string text =
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add({1, 2, 3}, { velocity = {1, 0, 0} })\n"
      "local forces = { sim.force.expression { '-m1*m2/r' } }\n" +
      kEnd;
  TextRun run(text, "rk4", 0.01);
  run.run_to(1);
  CHECK(run.system.position(0).x() == Approx(2));
  CHECK(run.system.energy().potential == 0);
}

TEST_CASE("formulas of single particles know what they carry", "[expression]") {
  const std::vector<Vec3> a =
      accelerations(charges("sim.force.expression { fx = '3*charge', fy = 'm*charge^2' }"));
  for (std::size_t i = 1; i < 4; ++i) {
    CHECK(a[i].x() == Approx(3 * kCharge[i] / kMasses[i]).margin(1e-15));
    CHECK(a[i].y() == Approx(kCharge[i] * kCharge[i]).margin(1e-15));
  }
}

TEST_CASE("numbers that no formula reads, and names with a meaning, are refused", "[expression]") {
  const auto scene = [](const std::string& options, const std::string& force) {
    return "local particles = sim.particles { mass = 1 }\nparticles:add({0, 0, 0}, { " + options +
           " })\nlocal forces = { " + force + " }\n" + kEnd;
  };
  CHECK(contains(said(scene("mas = 2", "sim.force.gravity {}")), "'mass'"));
  CHECK(contains(said(scene("charge = 2", "sim.force.expression { '0.5*x^2' }")), "charge"));
  CHECK(contains(said(scene("x = 2", "sim.force.expression { '0.5*x^2' }")), "meaning"));
  CHECK(contains(said(scene("charge = 0/0", "sim.force.expression { 'charge*x' }")), "finite"));
  CHECK(contains(said(scene("charge = 1", "sim.force.expression { 'charge*x', charge = 2 }")),
                 "variable of it already"));
}

TEST_CASE("a soft floor by a comparison pushes where it is passed alone", "[expression]") {
  // m y'' = -m g + (y < 0) (-k y): thrown down on it, the particle comes back as fast.
  const std::string text =
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add({0, 0.1, 0}, { velocity = {0, -2, 0} })\n"
      "local forces = { sim.force.expression { 'if(y < 0, 0.5*k*y^2, 0)',\n"
      "  k = 400 } }\n" +
      kEnd;
  TextRun run(text, "rk4", 1e-4);
  const double omega = 20, touch = 0.05, back = touch + std::numbers::pi / omega;
  run.run_to(touch + 0.05);
  CHECK(run.system.position(0).y() ==
        Approx(-2 / omega * std::sin(omega * (run.system.t() - touch))).epsilon(1e-6));
  run.run_to(back + 0.1);
  CHECK(run.system.position(0).y() == Approx(2 * (run.system.t() - back)).epsilon(1e-5));
}
