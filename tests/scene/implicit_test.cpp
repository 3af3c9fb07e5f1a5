// Implicit methods on whole scenes: accuracy, exact discrete answers, extremes, solvers.
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "core/base/error.h"
#include "tests/support/allocations.h"
#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;

namespace {

using Given = std::map<std::string, sim::Value>;
using Complex = std::complex<long double>;

const std::vector<std::string> kMethods = {"implicit_euler", "implicit_midpoint", "trbdf2", "bdf2"};

sim::RunOptions with(const std::string& method, double dt, Given given = {}) {
  sim::RunOptions options{.integrator = method, .dt = dt};
  options.integrator.given = std::move(given);
  return options;
}

// The stability function of the one-step methods.
Complex amplification(const std::string& method, Complex z) {
  const long double g = 2 - std::sqrt(2.0L);
  if (method == "implicit_euler") return 1.0L / (1.0L - z);
  if (method == "implicit_midpoint") return (1.0L + z / 2.0L) / (1.0L - z / 2.0L);
  return ((1 + (1 - g) * (1 - g)) * z + 2 * (2 - g)) /
         (z * z * g * (1 - g) + z * (g * g - 2) + 2 * (2 - g));
}

// The factor after n steps: powers of R(z), or the recursion of BDF2 after a step of TR-BDF2.
Complex discrete(const std::string& method, Complex z, int n) {
  if (method != "bdf2") return std::pow(amplification(method, z), n);
  Complex last = 1, now = amplification("trbdf2", z);
  for (int i = 1; i < n; ++i) {
    const Complex next = (4.0L / 3 * now - last / 3.0L) / (1.0L - 2.0L / 3 * z);
    last = now;
    now = next;
  }
  return now;
}

// rms over the coordinates against the exact positions at t = 1 s, in m.
double cloth_error(const std::string& method, int steps, sim::Registry& registry,
                   const Given& given = {}) {
  sim::Simulation cloth(make_cloth(8), registry, with(method, 1.0 / steps, given));
  REQUIRE(run(cloth, steps));
  double sum = 0;
  const Table table("cloth8.csv");
  for (const Row& row : table.rows_where("t", 1)) {
    const sim::Vec3 exact(row.number("x"), row.number("y"), row.number("z"));
    sum += (cloth.position(static_cast<int>(row.number("particle"))) - exact).squaredNorm();
  }
  return std::sqrt(sum / (3 * 64));
}

// The cloth with all stiffnesses times `factor`.
sim::SystemSpec make_stiff_cloth(int n, double factor, double drag) {
  sim::SystemSpec spec = make_cloth(n, {.drag = drag});
  for (sim::PartSpec& force : spec.forces)
    if (force.plugin == "spring")
      force.given["stiffness"] = factor * std::get<double>(force.given["stiffness"]);
  return spec;
}

}  // namespace

TEST_CASE("implicit methods multiply the circle by their stability function") {
  sim::Registry registry = make_registry();
  for (const std::string& method : kMethods)
    for (const double h : {0.01, 0.5, 10.0})
      for (const int n : {1, 2, 7, 100}) {
        sim::Simulation circle(make_circle(), registry, with(method, h));
        REQUIRE(run(circle, n));
        const Complex exact = discrete(method, {0, h}, n);
        const Complex found(circle.component(0), circle.component(1));
        INFO(method << " h " << h << " n " << n);
        CHECK(std::abs(found - exact) <= 1e-12L * std::max(1.0L, std::abs(exact)));
        CHECK(circle.component(2) == 0);
      }
}

TEST_CASE("implicit methods take exactly their discrete path on a linear spring") {
  // y'' = -49 (y + 1) - 9.81 - c y' about its rest y_e:  y - y_e is a sum of two powers.
  sim::Registry registry = make_registry();
  const long double k = 49, rest = -1 - 9.81L / k;
  for (const std::string& method : kMethods)
    for (const double drag : {0.0, 1.5})
      for (const double h : {0.01, 0.1, 1.0}) {
        const int n = 40;
        sim::Simulation spring(make_vertical_spring(drag), registry, with(method, h));
        REQUIRE(run(spring, n));
        const long double c = drag;
        const Complex root = std::sqrt(Complex(c * c / 4 - k)), one = -c / 2 + root,
                      two = -c / 2 - root;
        const Complex start = -1 - rest, a = start * two / (two - one), b = start - a;
        const Complex p = discrete(method, one * Complex(h), n),
                      q = discrete(method, two * Complex(h), n);
        INFO(method << " drag " << drag << " h " << h);
        CHECK(std::abs(Complex(spring.position(1).y()) - (rest + a * p + b * q)) <= 1e-12);
        CHECK(std::abs(Complex(spring.velocity(1).y()) - (a * one * p + b * two * q)) <= 1e-11);
        CHECK(spring.position(1).x() == 0);
      }
}

TEST_CASE("backward Euler shrinks an oscillation by 1 / sqrt(1 + (omega h)^2) a step") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_vertical_spring(0);
  const double rest = -1 - 9.81 / 49, omega = 7, h = 0.05;
  sim::Simulation spring(spec, registry, with("i", h));
  const auto amplitude = [&] {
    return std::hypot(spring.position(1).y() - rest, spring.velocity(1).y() / omega);
  };
  double before = amplitude();
  for (int n = 0; n < 50; ++n) {
    REQUIRE(spring.step());
    CHECK(amplitude() / before == Approx(1 / std::sqrt(1 + omega * h * omega * h)).epsilon(1e-11));
    before = amplitude();
  }
}

// Figures of implementations in other arithmetic, to the digits they are known to.
TEST_CASE("a step of an implicit method buys the accuracy that the textbook method has") {
  sim::Registry registry = make_registry();
  struct Accuracy {
    const char* method;
    int steps;
    double rms, margin;
  };
  for (const auto& [method, steps, rms, margin] : {Accuracy{"implicit_euler", 64, 2.96e-2, 0.01},
                                                   {"implicit_euler", 512, 5.7e-3, 0.01},
                                                   {"implicit_midpoint", 64, 1.9e-3, 0.03},
                                                   {"implicit_midpoint", 512, 3.6e-5, 0.03},
                                                   {"trbdf2", 64, 1.0e-3, 0.05},
                                                   {"trbdf2", 512, 1.8e-5, 0.03},
                                                   {"bdf2", 512, 1.4e-4, 0.04}}) {
    INFO(method << " in " << steps << " steps");
    CHECK(cloth_error(method, steps, registry) == Approx(rms).epsilon(margin));
  }
  // A single linearised step (Baraff & Witkin): with the exact Hessian as good as Newton's method,
  // with the clamped one worse.
  const Given single = {{"newton_steps", std::int64_t{1}}};
  const Given clamped = {{"newton_steps", std::int64_t{1}}, {"hessian", std::string("clamped")}};
  const double iterated = cloth_error("implicit_euler", 512, registry);
  CHECK(cloth_error("implicit_euler", 512, registry, single) == Approx(iterated).epsilon(1e-4));
  CHECK(cloth_error("implicit_euler", 512, registry, clamped) > 1.0004 * iterated);
}

TEST_CASE("solvers and Hessians agree on the solution of a step") {
  sim::Registry registry = make_registry();
  for (const std::string& method : kMethods) {
    std::vector<std::vector<double>> states;
    for (const char* solver : {"cg", "ldlt", "auto"})
      for (const char* hessian : {"exact", "clamped"}) {
        sim::Simulation cloth(make_stiff_cloth(8, 10, 2), registry,
                              with(method, 0.02,
                                   {{"solver", std::string(solver)},
                                    {"hessian", std::string(hessian)},
                                    {"tol", 1e-12}}));
        REQUIRE(run(cloth, 25));
        const sim::Effort effort = cloth.integrator().effort();
        CHECK(effort.newton > 25);
        CHECK(effort.residual <= 1e-9);
        CHECK((effort.factorisations > 0) == (std::string(solver) == "ldlt"));
        CHECK((effort.linear > 0) == (std::string(solver) != "ldlt"));
        states.push_back(state_of(cloth));
      }
    for (const auto& state : states)
      for (std::size_t i = 0; i < state.size(); ++i)
        REQUIRE(state[i] == Approx(states[0][i]).margin(1e-8));
  }
}

TEST_CASE("pinned particles stay bit for bit however few iterations are made") {
  sim::Registry registry = make_registry();
  for (const std::string& method : kMethods)
    for (const char* solver : {"cg", "ldlt"}) {
      sim::SystemSpec spec = make_cloth(6);
      spec.particles->grid->origin = {0.1, 1.0 / 3, -0.7};
      spec.particles->pinned = {0, 5, 21};
      sim::Simulation cloth(
          spec, registry,
          with(method, 0.03,
               {{"solver", std::string(solver)}, {"newton_steps", std::int64_t{1}}, {"tol", 0.1}}));
      std::vector<sim::Vec3> start;
      for (const int i : {0, 5, 21}) start.push_back(cloth.position(i));
      REQUIRE(run(cloth, 50));
      for (std::size_t p = 0; p < 3; ++p) {
        const int i = spec.particles->pinned[p];
        CHECK((cloth.position(i) == start[p] && cloth.velocity(i) == sim::Vec3::Zero()));
      }
    }
}

TEST_CASE("far above the explicit limit the energy of damped methods never rises") {
  sim::Registry registry = make_registry();
  const double limit = 0.0147;  // s, of rk4
  for (const std::string method : {"implicit_euler", "trbdf2"})
    for (const double factor : {1.0, 100.0, 1e5})
      for (const double multiple : {10.0, 100.0}) {
        sim::Simulation cloth(make_stiff_cloth(8, factor, 2), registry,
                              with(method, multiple * limit / std::sqrt(factor)));
        double energy = cloth.energy().total(), rise = 0;
        for (int n = 0; n < 60; ++n) {
          REQUIRE(cloth.step());
          rise = std::max(rise, cloth.energy().total() - energy);
          energy = cloth.energy().total();
        }
        INFO(method << ", stiffness times " << factor << ", " << multiple << " times the limit");
        CHECK(rise <= 1e-9);
        for (int i = 0; i < 64; ++i) CHECK(cloth.position(i).norm() < 3);
      }
}

TEST_CASE("steps of any size converge or say that they did not") {
  sim::Registry registry = make_registry();
  int converged = 0;
  for (const std::string& method : kMethods)
    for (const double h : {0.15, 1.0, 1000.0})
      for (const double factor : {1.0, 1e5, 1e10}) {
        sim::Simulation cloth(make_stiff_cloth(8, factor, 2), registry, with(method, h));
        INFO(method << " h " << h << ", stiffness times " << factor);
        if (run(cloth, 3)) {
          ++converged;
          for (int i = 0; i < 64; ++i) CHECK(cloth.position(i).allFinite());
        } else {
          CHECK(cloth.divergence().status != sim::StepStatus::kDone);
          CHECK(cloth.divergence().step >= 1);
        }
      }
  CHECK(converged >= 12);
}

TEST_CASE("implicit runs do not depend on threads and start afresh after a reset") {
  sim::Registry registry = make_registry();
  for (const std::string& method : kMethods) {
    const sim::SystemSpec spec = make_stiff_cloth(96, 10, 2);
    sim::RunOptions options = with(method, 0.01);
    sim::Simulation one(spec, registry, options);
    options.threads = 2;
    sim::Simulation two(spec, registry, options);
    REQUIRE(run(one, 3));
    REQUIRE(run(two, 3));
    const std::uint64_t end = one.hash();
    CHECK(two.hash() == end);
    one.reset();
    REQUIRE(run(one, 3));
    CHECK(one.hash() == end);
  }
}

TEST_CASE("wrong parameters of implicit methods are refused with what is known") {
  sim::Registry registry = make_registry();
  const auto refusal = [&](const Given& given) -> std::string {
    try {
      sim::Simulation(make_cloth(4), registry, with("implicit_euler", 0.01, given));
    } catch (const sim::Error& error) {
      return error.what();
    }
    return "";
  };
  CHECK_THAT(refusal({{"solver", std::string("lu")}}), Catch::Contains("cg, ldlt"));
  CHECK_THAT(refusal({{"hessian", std::string("none")}}), Catch::Contains("exact, clamped"));
  CHECK_THAT(refusal({{"newton_steps", std::int64_t{0}}}), Catch::Contains("newton_steps"));
  CHECK_THAT(refusal({{"tol", -1.0}}), Catch::Contains("tol"));
  sim::SystemSpec large = make_circle();
  large.first_order->state.assign(3000, 1.0);
  // Thousands of numbers are no reason to refuse: of each, the derivative reads one other.
  sim::Simulation many(large, registry, with("trbdf2", 0.1));
  CHECK(many.step());
}

TEST_CASE("projective dynamics approaches backward Euler") {
  // Figures of an implementation in other arithmetic; 2.9646e-2 is backward Euler itself.
  sim::Registry registry = make_registry();
  const auto error = [&](int iterations) {
    return cloth_error("projective_dynamics", 64, registry,
                       {{"iterations", std::int64_t{iterations}}});
  };
  CHECK(error(1) == Approx(4.3e-2).epsilon(0.01));
  CHECK(error(10) == Approx(2.996e-2).epsilon(0.001));
  CHECK(error(50) == Approx(2.965e-2).epsilon(0.001));

  sim::Simulation exact(make_cloth(8), registry, with("implicit_euler", 0.02, {{"tol", 1e-12}}));
  sim::Simulation near(make_cloth(8), registry,
                       with("projective_dynamics", 0.02, {{"iterations", std::int64_t{1000}}}));
  REQUIRE(run(exact, 20));
  REQUIRE(run(near, 20));
  for (int i = 0; i < 64; ++i) CHECK((exact.position(i) - near.position(i)).norm() <= 1e-10);
  CHECK(near.integrator().effort().factorisations == 1);
  CHECK(near.integrator().effort().newton == 20 * 1000);

  CHECK_THROWS_WITH(sim::Simulation(make_circle(), registry, with("projective_dynamics", 0.1)),
                    Catch::Contains("first order") && Catch::Contains("implicit_euler"));
}

TEST_CASE("forces that give no Jacobian work with implicit methods, with a note that names them") {
  sim::Registry registry = make_registry();
  for (const char* name : {"attraction", "air_drag"})
    registry.load(std::string(SIM_FIXTURE_DIR) + "/" + name + "/" + name + ".so");
  const auto attracted = [&](const std::string& method, double h) {
    sim::SystemSpec spec = make_falling(2, 0);
    spec.forces = {make_part("attraction", {{"k", 50.0}, {"center", sim::Vec3(0, 1, 0)}})};
    return sim::Simulation(spec, registry, with(method, h, {{"tol", 1e-13}}));
  };
  // An oscillator of 5 rad/s about the centre.
  for (const std::string& method : kMethods) {
    const double h = 0.3;
    const int n = 20;
    sim::Simulation simulation = attracted(method, h);
    REQUIRE(run(simulation, n));
    const Complex factor = discrete(method, {0, 5 * h}, n);
    const sim::Vec3 centre(0, 1, 0), x(0.5, 2, -1), v(1, 3, -2);
    for (int axis = 0; axis < 3; ++axis) {
      const Complex exact = Complex(x[axis] - centre[axis], -v[axis] / 5) * factor;
      CHECK(std::abs(simulation.position(0)[axis] - centre[axis] - exact.real()) <= 1e-9);
    }
    REQUIRE(simulation.integrator().notes().size() == 1);
    CHECK_THAT(simulation.integrator().notes()[0], Catch::Contains("'attraction'"));
  }
  CHECK(sim::Simulation(make_cloth(4), registry, with("trbdf2", 0.1)).integrator().notes().empty());
  CHECK_THROWS_WITH(sim::Simulation(
                        [&] {
                          sim::SystemSpec spec = make_cloth(4);
                          spec.forces.push_back(make_part("attraction", {{"k", 1.0}}));
                          return spec;
                        }(),
                        registry, with("trbdf2", 0.1, {{"solver", std::string("ldlt")}})),
                    Catch::Contains("'attraction'"));

  // Among springs, and depending on velocity and time.
  sim::SystemSpec windy = make_cloth(9);
  windy.forces.push_back(make_part("air_drag", {{"c", 0.02}}));
  sim::Simulation exact(windy, registry, with("rk4", 1e-3)),
      found(windy, registry, with("trbdf2", 2e-3));
  REQUIRE(run(exact, 300));
  REQUIRE(run(found, 150));
  double worst = 0;
  for (int i = 0; i < 81; ++i)
    worst = std::max(worst, (exact.position(i) - found.position(i)).norm());
  CHECK(worst < 5e-5);
  CHECK(found.integrator().effort().newton < 150 * 2 * 5);
}

TEST_CASE("the sparse factorisation takes no memory in a step") {
  sim::Registry registry = make_registry();
  for (const char* method : {"implicit_euler", "bdf2"}) {
    sim::Simulation cloth(make_cloth(12), registry,
                          with(method, 0.02, {{"solver", std::string("ldlt")}}));
    REQUIRE(cloth.step());
    const std::size_t before = allocation_count();
    REQUIRE(run(cloth, 10));
    CHECK(allocation_count() == before);
  }
}
