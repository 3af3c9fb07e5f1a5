// Damping along springs: closed forms, balances, derivatives, and every way of stepping.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "core/base/error.h"
#include "core/ode/jacobian.h"
#include "core/particles/springs/dashpots.h"
#include "core/study/energy_balance.h"
#include "core/study/limits/spectrum.h"
#include "tests/support/reference_model.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim_test;

namespace {

constexpr double kStiffness = 50, kRest = 1, kLight = 1, kHeavy = 3;
constexpr double kReduced = kLight * kHeavy / (kLight + kHeavy);  // kg, of two particles

PartSpec damped(PartSpec part, double damping) {
  part.given["damping"] = damping;
  return part;
}

// Two free particles on one damped spring along (2, -1, 2), which is drawn out by 0.2 m.
SystemSpec make_pair(double damping) {
  SystemSpec spec;
  spec.name = "pair";
  spec.integrator = "rk4";
  spec.dt = 0.001;
  spec.duration = 1;
  spec.particles.emplace();
  spec.particles->list.resize(2);
  spec.particles->list[0].mass = kLight;
  spec.particles->list[1].mass = kHeavy;
  spec.particles->list[1].position = Vec3(2, -1, 2) / 3 * 1.2;
  spec.forces = {damped(make_springs("spring", kStiffness), damping)};
  spec.forces.back().elements.add({0, 1}, {{"rest", kRest}});
  return spec;
}

// Springs of many kinds: runs of one damping, a tie without, a run of many dampings, and a net.
SystemSpec make_tangle(int n = 40) {
  SystemSpec spec;
  spec.name = "tangle";
  spec.integrator = "rk4";
  spec.dt = 0.001;
  spec.duration = 1;
  spec.particles.emplace();
  for (int i = 0; i < n; ++i) {
    ParticleSpec particle;
    particle.mass = 0.5 + 0.1 * (i % 3);
    for (int axis = 0; axis < 3; ++axis) {
      particle.position[axis] = std::sin(1.0 + 3 * i + 7 * axis) + 0.1 * i;
      particle.velocity[axis] = std::cos(2.0 + 5 * i + 3 * axis);
    }
    spec.particles->list.push_back(particle);
  }
  spec.particles->pinned = {5};
  spec.forces = {make_gravity(), damped(make_springs("chain", 30), 0.7), make_springs("far", 20),
                 make_drag(0.05)};
  Elements &chain = spec.forces[1].elements, &far = spec.forces[2].elements;
  for (int i = 0; i + 1 < n; ++i) chain.add({i, i + 1}, {{"rest", 0.4}});
  chain.values["damping"].assign(chain.listed(), std::nan(""));
  chain.values["damping"][3] = 0;
  for (int i = 0; i + 9 < n; ++i) far.add({i + 9, i}, {{"rest", 0.9}, {"damping", 0.1 + 0.01 * i}});
  for (int i = 0; i < n / 4; ++i)
    far.add({i, (i * i + 31) % 9 + n - 10}, {{"rest", 1.5}, {"damping", 0.3}});
  return spec;
}

Simulation simulate(const SystemSpec& spec, Registry& registry, const std::string& method,
                    double dt, int steps, int threads = 1) {
  RunOptions options = fixed_steps(method, dt, registry);
  options.threads = threads;
  Simulation simulation(spec, registry, options);
  REQUIRE(run(simulation, steps));
  return simulation;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

// s = |d| - r of a released pair, s'' + 2 beta s' + omega^2 s = 0.
double stretch(double damping, double t) {
  const double s0 = 0.2, beta = damping / (2 * kReduced), square = kStiffness / kReduced;
  const double e = s0 * std::exp(-beta * t), rest = square - beta * beta;
  if (std::abs(rest) < 1e-9 * square) return e * (1 + beta * t);
  const double w = std::sqrt(std::abs(rest));
  return rest > 0 ? e * (std::cos(w * t) + beta / w * std::sin(w * t))
                  : e * (std::cosh(w * t) + beta / w * std::sinh(w * t));
}

}  // namespace

TEST_CASE("a damped pair follows the closed form, whatever its damping") {
  Registry registry = make_registry();
  const double critical = 2 * std::sqrt(kStiffness * kReduced);
  for (const double damping : {0.3 * critical, critical, 2.5 * critical})
    for (const auto& [method, bound] : std::vector<std::pair<std::string, double>>{
             {"rk4", 1e-9}, {"dop853", 1e-9}, {"verlet", 1e-4}, {"implicit_midpoint", 1e-4}}) {
      INFO(method << ", damping " << damping);
      const Simulation pair = simulate(make_pair(damping), registry, method, 0.002, 250);
      const double length = (pair.position(0) - pair.position(1)).norm();
      CHECK(length - kRest == Approx(stretch(damping, 0.5)).margin(bound));
      CHECK((kLight * pair.velocity(0) + kHeavy * pair.velocity(1)).norm() <= 1e-12);
    }
}

TEST_CASE("the force of a dashpot lies along it, at any size") {
  const Vec3 w(0.3, -2, 0.7);
  for (const double size : {1.0, 1e-170, 1e-200, 1e170, 1e200}) {
    const Vec3 u = Vec3(1, 2, -2) / 3, force = dashpot_force(size * u, w, 4);
    CHECK((force + 4 * w.dot(u) * u).norm() <= 1e-14);
  }
  CHECK(dashpot_force(Vec3::Zero(), w, 4) == Vec3::Zero());
}

TEST_CASE("damped springs in runs and nets agree with a plain model") {
  Registry registry = make_registry();
  const SystemSpec spec = make_tangle();
  ReferenceModel plain(spec);
  for (int step = 0; step < 100; ++step) plain.step("rk4", 0.002);
  const Simulation kernel = simulate(spec, registry, "rk4", 0.002, 100);
  CHECK(distance(state_of(kernel), plain.state()) <= 1e-11);
}

TEST_CASE("damped springs at all lengths: blocks of tiny and huge ones keep the force of each") {
  Registry registry = make_registry();
  SystemSpec spec = make_tangle(16);
  spec.particles->list[3].position = spec.particles->list[4].position;  // d = 0
  spec.particles->list[8].position = spec.particles->list[7].position + Vec3(1e-200, 0, 0);
  Simulation kernel(spec, registry);
  for (int i = 0; i < 16; ++i) {
    Vec3 sum = Vec3::Zero(), expected = Vec3::Zero();
    for (const ForceShare& share : kernel.forces_on(i))
      if (share.name.ends_with(" with damping")) sum += share.force;
    for (const PartSpec& part : spec.forces)
      part.elements.for_each([&](const Element& tie) {
        if (tie.ids[0] != i && tie.ids[1] != i) return;
        const int to = tie.ids[0] + tie.ids[1] - i;
        const double own = part.elements.values.at("damping")[static_cast<std::size_t>(tie.index)];
        const double c = std::isnan(own) ? 0.7 : own;
        expected += dashpot_force(kernel.position(i) - kernel.position(to),
                                  kernel.velocity(i) - kernel.velocity(to), c);
      });
    INFO("particle " << i);
    CHECK((sum - expected).norm() <= 1e-13);
  }
}

TEST_CASE("damped springs keep momentum and angular momentum") {
  Registry registry = make_registry();
  Simulation kernel(make_tangle(), registry);
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  for (int i = 0; i < kernel.particles(); ++i)
    for (const ForceShare& share : kernel.forces_on(i)) {
      if (!share.name.ends_with(" with damping")) continue;
      force += share.force;
      torque += kernel.position(i).cross(share.force);
    }
  CHECK(force.norm() <= 1e-12);
  CHECK(torque.norm() <= 1e-12);
}

TEST_CASE("damped springs have the same bits on every machine and for any threads") {
  Registry registry = make_registry();
  for (const std::string method : {"rk4", "dopri5", "verlet", "implicit_midpoint"}) {
    INFO(method);
    const SystemSpec spec = make_tangle(200);
    const std::uint64_t hash = simulate(spec, registry, method, 0.002, 20).hash();
    for (const char* level : {"sse2", "fma", "avx2", "avx512"})
      for (const int threads : {1, 2, 3}) {
        setenv("SIM_SIMD", level, 1);
        CHECK(simulate(spec, registry, method, 0.002, 20, threads).hash() == hash);
      }
    unsetenv("SIM_SIMD");
  }
}

TEST_CASE("methods keep their order on damped springs") {
  Registry registry = make_registry();
  SystemSpec spec = make_pair(1.5);
  spec.particles->list[1].velocity = Vec3(0.5, 2, -1);
  spec.forces.push_back(make_gravity());
  const std::vector<double> exact = state_of(simulate(spec, registry, "rk4", 1e-4, 5000));
  const auto error = [&](const std::string& method, int steps) {
    return distance(state_of(simulate(spec, registry, method, 0.5 / steps, steps)), exact);
  };
  for (const auto& [method, order] :
       std::vector<std::pair<std::string, double>>{{"euler", 1},
                                                   {"symplectic_euler", 1},
                                                   {"implicit_euler", 1},
                                                   {"trapezoid", 2},
                                                   {"verlet", 2},
                                                   {"implicit_midpoint", 2},
                                                   {"trbdf2", 2},
                                                   {"bdf2", 2},
                                                   {"rk4", 4}}) {
    INFO(method);
    const int steps = order == 4 ? 40 : 200;
    CHECK(std::log2(error(method, steps) / error(method, 2 * steps)) == Approx(order).margin(0.15));
  }
}

TEST_CASE("the Jacobian of damped springs agrees with differences") {
  Registry registry = make_registry();
  Simulation kernel(make_tangle(), registry);
  OdeSystem& system = kernel.ode();
  const std::vector<double> x(kernel.state().begin(), kernel.state().end());
  std::vector<double> dx(x.size()), exact(x.size()), differences(x.size());
  for (std::size_t i = 0; i < dx.size(); ++i)
    dx[i] = x[i] == 0 ? 0 : std::cos(static_cast<double>(3 * i));
  const auto own = system.jacobian(), other = difference_jacobian(system);
  own->at(0, x.data());
  own->apply(dx.data(), exact.data());
  other->at(0, x.data());
  other->apply(dx.data(), differences.data());
  const double size = distance(exact, std::vector<double>(exact.size()));
  CHECK(distance(exact, differences) <= 1e-8 * size);
}

TEST_CASE("implicit Euler takes energy out of damped springs") {
  Registry registry = make_registry();
  SystemSpec spec = make_tangle();
  spec.forces.erase(spec.forces.begin());
  for (const double dt : {0.001, 0.01, 0.1}) {
    RunOptions options{.integrator = {"implicit_euler"}, .dt = dt};
    Simulation kernel(spec, registry, options);
    double before = kernel.energy().total();
    for (int step = 0; step < 20; ++step) {
      INFO("dt " << dt << ", step " << step);
      REQUIRE(kernel.step());
      CHECK(kernel.energy().total() <= before + 1e-9 * std::abs(before));
      before = kernel.energy().total();
    }
  }
}

TEST_CASE("what damped springs take is in the balance of energy") {
  Registry registry = make_registry();
  RunOptions options{.integrator = {"rk4"}, .dt = 0.001};
  Simulation kernel(make_tangle(), registry, options);
  CHECK_FALSE(kernel.conserves_energy());
  study::EnergyBalance balance(kernel);
  const double start = kernel.energy().total();
  for (int step = 0; step < 400; ++step) {
    REQUIRE(kernel.step());
    balance.advance();
  }
  balance.look();
  CHECK_FALSE(balance.has_work());
  CHECK(balance.taken() == Approx(start - kernel.energy().total()).epsilon(1e-5));
  CHECK(balance.taken() > 1);
}

TEST_CASE("the damping of a spring shows in the spectrum") {
  Registry registry = make_registry();
  SystemSpec spec = make_pair(1.5);
  spec.forces.back().elements.values["rest"][0] = 1.2;
  Simulation pair(spec, registry);
  const study::Vibration fastest = study::spectrum(pair).fastest;
  CHECK(fastest.omega == Approx(std::sqrt(kStiffness / kReduced)));
  CHECK(fastest.damping == Approx(1.5 / kReduced));
}

TEST_CASE("a run of damped springs goes on from a snapshot bit for bit") {
  Registry registry = make_registry();
  for (const std::string method : {"rk4", "verlet", "bdf2"}) {
    Simulation whole = simulate(make_tangle(), registry, method, 0.002, 30);
    Simulation first = simulate(make_tangle(), registry, method, 0.002, 10);
    Simulation second(make_tangle(), registry, fixed_steps(method, 0.002, registry));
    second.restore(first.snapshot());
    REQUIRE(run(second, 20));
    CHECK(second.hash() == whole.hash());
  }
}

TEST_CASE("auto finds a method for damped springs") {
  Registry registry = make_registry();
  for (const double tol : {1e-2, 1e-5, 1e-9}) {
    const RunOptions options{.integrator = {"auto", {{"tol", tol}}}, .dt = 0.01};
    Simulation kernel(make_tangle(), registry, options);
    CHECK(run(kernel, 10));
  }
}

TEST_CASE("what cannot have damped springs says so") {
  Registry registry = make_registry();
  SystemSpec chain = make_tangle();
  chain.forces.erase(chain.forces.begin() + 2);  // springs in a net
  const auto refusal = [&](RunOptions options) {
    try {
      Simulation(chain, registry, options);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const RunOptions single{.integrator = {"rk4", {{"precision", std::string("single")}}}};
  CHECK_THAT(refusal(single), Catch::Contains("damping"));
  CHECK_THAT(refusal({.integrator = {"projective_dynamics"}}), Catch::Contains("damping"));
  CHECK_THAT(refusal({.integrator = {"pefrl"}}), Catch::Contains("depends on velocity"));
}
