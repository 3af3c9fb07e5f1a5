// The stage solvers of particles and of plain systems, by what they promise.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/error.h"
#include "core/ode/implicit/dense_solver.h"
#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"
#include "plugins/solvers/particles/block_kernels.h"
#include "plugins/solvers/particles/lbfgs.h"
#include "plugins/solvers/particles/particle_solvers.h"
#include "plugins/solvers/particles/stage_equation.h"
#include "tests/support/scenes.h"

using namespace sim;

namespace {

constexpr int kParticles = 40;

class Chain final : public Force {
 public:
  void bind(const ParticleView& initial) override {
    springs_.emplace(initial.n, [&](const Springs::Visit& visit) {
      for (int i = 0; i + 1 < initial.n; ++i) visit(i, i + 1, 300, 0.5);
      for (int i = 0; i + 7 < initial.n; i += 2) visit(i, i + 7, 40, i % 4 == 0 ? 0 : 2);
    });
  }
  const Springs* springs() const override { return &*springs_; }
  double potential(const ParticleView& view, Tile tile) const override {
    return springs_->potential(view, tile);
  }

 private:
  std::optional<Springs> springs_;
};

class GravityDrag final : public Force {
 public:
  std::optional<AffineForce> affine() const override { return AffineForce{{0.5, -9.81, 0}, 0.3}; }
};

// f_i = -s (x_i - x_other), and a drag that grows with |v|; not symmetric: others feel nothing.
class Lead final : public Force {
 public:
  Lead(bool blocks, bool pairs) : blocks_(blocks), pairs_(pairs) {}
  void accumulate(const ParticleView& p, Tile tile, ForceSink sink) const override {
    for (int i = std::max(1, tile.begin); i < tile.end; ++i)
      sink.add(i,
               -20 * (p.position(i) - p.position(0)) - 0.4 * p.velocity(i).norm() * p.velocity(i));
  }
  bool has_jacobian() const override { return blocks_; }
  void jacobian(const ParticleView& p, JacobianSink& sink) const override {
    for (int i = 1; i < p.n; ++i) {
      sink.position(i, i, -20 * Mat3::Identity());
      sink.position(i, 0, 20 * Mat3::Identity());
      const Vec3 v = p.velocity(i);
      const double speed = v.norm();
      if (speed == 0) continue;
      sink.velocity(i, i, -0.4 * (speed * Mat3::Identity() + outer(v, v) / speed));
    }
  }
  bool couplings(std::vector<std::array<int, 2>>& pairs) const override {
    for (int i = 1; pairs_ && i < kParticles; ++i) pairs.push_back({i, 0});
    return pairs_;
  }

 private:
  bool blocks_, pairs_;
};

enum class Other { kNone, kBlocks, kPairs, kDifferences };

struct Scene {
  ThreadPool pool{1};
  Layout layout{kParticles};
  Array x{layout.size()}, y{layout.size()};
  std::unique_ptr<ParticleSystem> system;

  explicit Scene(Other other) {
    for (int i = 0; i < kParticles; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        layout.block(x.data(), axis)[i] = 0.4 * i * (axis == 0) + 0.2 * std::sin(3.0 * i + axis);
        layout.block(x.data(), 3 + axis)[i] = i == 3 ? 0 : std::cos(2.0 * i + axis);
      }
    std::vector<double> masses(kParticles);
    for (int i = 0; i < kParticles; ++i)
      masses[static_cast<std::size_t>(i)] = i % 5 == 0 ? 1e-3 : 1 + 0.1 * i;
    std::vector<std::unique_ptr<Force>> forces;
    forces.push_back(std::make_unique<Chain>());
    forces.push_back(std::make_unique<GravityDrag>());
    if (other != Other::kNone)
      forces.push_back(
          std::make_unique<Lead>(other != Other::kDifferences, other == Other::kPairs));
    system = std::make_unique<ParticleSystem>(masses, std::vector<int>{3}, std::move(forces),
                                              x.data(), pool);
    system->set_implicit_solvers(make_particle_solvers);
  }

  // The largest |y - tau f(t, y) - x| of a solution.
  double residual(StageSolver& solver, double tau) {
    std::ranges::copy(x.span(), y.data());
    REQUIRE(solver.solve(0.2, tau, x.data(), y.data()) == StepStatus::kDone);
    Array at(layout.size()), f(layout.size());
    system->eval(0.2, {y.data(), {}}, at.data(), f.data());
    double worst = 0;
    for (int block = 0; block < 6; ++block)
      for (int i = 0; i < kParticles; ++i) {
        const auto value = [&](const Array& a) { return layout.block(a.data(), block)[i]; };
        worst = std::max(worst, std::abs(value(y) - tau * value(f) - value(x)));
      }
    return worst;
  }
};

}  // namespace

TEST_CASE("every solver of stages solves Y - tau f(t, Y) = r", "[particles]") {
  for (const Other other : {Other::kNone, Other::kBlocks, Other::kPairs, Other::kDifferences})
    for (const double tau : {1e-3, 0.05, 1.0}) {
      Scene scene(other);
      INFO("forces " << static_cast<int>(other) << ", tau " << tau);
      const StageOptions tight{.tolerance = 1e-13};
      const auto own = scene.system->stage_solver(tight);
      // Light particles: forces of some 1e5 m/s^2 cancel, to rounding.
      CHECK(scene.residual(*own, tau) <= 1e-7);
      if (tau < 1) {
        DenseSolver dense(*scene.system, tight);
        CHECK(scene.residual(dense, tau) <= 1e-7);
      }
      // Its particles are light and its springs stiff: factors of the symmetric part.
      if (other == Other::kPairs) CHECK((own->effort().factorisations > 0) == (tau == 1));
      if (other == Other::kBlocks || other == Other::kDifferences) {
        CHECK(own->effort().factorisations == 0);
        CHECK_THROWS_WITH(scene.system->stage_solver({.solver = StageOptions::Solver::kDirect}),
                          Catch::Contains("always couple the same particles"));
        continue;
      }
      for (const auto solver : {StageOptions::Solver::kDirect, StageOptions::Solver::kIterative}) {
        StageOptions options = tight;
        options.solver = solver;
        const auto forced = scene.system->stage_solver(options);
        CHECK(scene.residual(*forced, tau) <= 1e-7);
        CHECK((forced->effort().factorisations > 0) == (solver == StageOptions::Solver::kDirect));
      }
    }
}

// A guess that is off by the change of a short step is no solution: multistep methods that were
// told so went on for ever with the slope of their last step.
TEST_CASE("a step far shorter than the motion is solved to its own size", "[particles]") {
  for (const Other other : {Other::kNone, Other::kBlocks})
    for (const double tau : {1e-11, 1e-9, 1e-7}) {
      Scene scene(other);
      INFO("forces " << static_cast<int>(other) << ", tau " << tau);
      const auto solver = scene.system->stage_solver({.tolerance = 1e-10});
      CHECK(scene.residual(*solver, tau) <= 1e-12 + 1e-6 * tau);
    }
}

// Factors belong to one tau: a solver that comes back to a length of step solves for that one.
TEST_CASE("a solver that has solved for other steps solves as one that has not", "[particles]") {
  using Method = StageOptions::Method;
  for (const Method method : {Method::kNewton, Method::kLocalGlobal}) {
    StageOptions options{.tolerance = 1e-13, .method = method};
    if (method == Method::kLocalGlobal) options.newton_steps = 30;
    const auto solution = [&](std::initializer_list<double> taus) {
      Scene scene(Other::kNone);
      const auto solver = scene.system->stage_solver(options);
      for (const double tau : taus) {
        solver->restart();
        std::ranges::copy(scene.x.span(), scene.y.data());
        REQUIRE(solver->solve(0.2, tau, scene.x.data(), scene.y.data()) == StepStatus::kDone);
      }
      if (method == Method::kLocalGlobal) {
        // One matrix for each new tau; as many iterations as were asked for.
        CHECK(solver->effort().newton == 30 * static_cast<std::int64_t>(taus.size()));
        CHECK(solver->effort().factorisations == static_cast<std::int64_t>(taus.size()));
      }
      return std::vector<double>(scene.y.span().begin(), scene.y.span().end());
    };
    for (const double tau : {1e-3, 0.02})
      CHECK(solution({tau}) == solution({0.01, tau, 0.005, tau}));
  }
}

TEST_CASE("projective dynamics solves for springs and drag, and divides its residual by the first",
          "[particles]") {
  Scene scene(Other::kNone);
  const auto solver = scene.system->stage_solver(
      {.newton_steps = 400, .method = StageOptions::Method::kLocalGlobal});
  CHECK(scene.residual(*solver, 1e-3) <= 1e-9);
  CHECK(solver->effort().factorisations == 1);
  CHECK(solver->effort().newton == 400);
  CHECK(solver->effort().residual < 1e-9);
  // Again for the same tau: the factors are kept.
  CHECK(scene.residual(*solver, 1e-3) <= 1e-9);
  CHECK(solver->effort().factorisations == 1);
  CHECK(solver->effort().newton == 800);
  // Without an iteration the residual is the first: of it, all is left.
  const auto none =
      scene.system->stage_solver({.newton_steps = 0, .method = StageOptions::Method::kLocalGlobal});
  scene.residual(*none, 1e-3);
  CHECK(none->effort().residual == 1);
}

TEST_CASE("Newton's method converges quadratically with blocks and with differences") {
  for (const Other other : {Other::kNone, Other::kBlocks, Other::kPairs, Other::kDifferences}) {
    Scene scene(other);
    const auto solver = scene.system->stage_solver({.tolerance = 1e-12});
    CHECK(scene.residual(*solver, 0.02) <= 1e-8);
    CHECK(solver->effort().newton <= 12);
    CHECK(solver->notes().size() == (other == Other::kDifferences ? 1u : 0u));
  }
}

// From I, the inverse of the last pairs takes every change of the gradient to its step.
TEST_CASE("a limited memory maps the last change of a gradient to its step, and stays positive") {
  const std::size_t size = Layout(10, 3).size();
  Array d(size), before(size), after(size), x(size), y(size);
  Lbfgs memory(size);
  const auto some = [](Array& to, int seed) {
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = std::sin(1.7 * i * seed + seed);
  };
  constexpr double kLength = 0.3;
  for (int seed = 1; seed < 9; ++seed) {
    some(d, seed);
    for (std::size_t i = 0; i < size; ++i) {
      const double stiffness = 1 + 3.0 * (i % 5);
      before[i] = -d[i];
      after[i] = before[i] + kLength * stiffness * d[i];
      y[i] = x[i] = after[i] - before[i];
    }
    memory.learn(kLength, d, before, after);
    memory.first_half(x);
    memory.second_half(x);
    for (std::size_t i = 0; i < size; ++i) REQUIRE(x[i] == Approx(kLength * d[i]).margin(1e-12));
    // Down where the slope says nothing of a curvature: nothing is learned, and H stays the same.
    for (std::size_t i = 0; i < size; ++i) after[i] = before[i] - 2 * d[i];
    memory.learn(kLength, d, before, after);
    memory.first_half(y);
    memory.second_half(y);
    CHECK(std::ranges::equal(x.span(), y.span()));
    some(x, seed + 20);
    std::ranges::copy(x.span(), y.data());
    memory.first_half(y);
    memory.second_half(y);
    CHECK(dot(x, y) > 0);
  }
}

// Folds form all over this sheet as it falls: Newton's method alone takes 285 steps.
TEST_CASE("steps of Newton's method are few where a stiff cloth folds") {
  Registry registry = sim_test::make_registry();
  SystemSpec sheet = sim_test::make_cloth(32);
  for (PartSpec& force : sheet.forces)
    if (force.plugin == "spring")
      force.given["stiffness"] = 1e5 * *std::get_if<double>(&force.given["stiffness"]);
  RunOptions options{.integrator = "implicit_euler", .dt = 0.01};
  options.integrator.given["tol"] = 1e-6;
  Simulation cloth(sheet, registry, options);
  REQUIRE(sim_test::run(cloth, 10));
  const Effort effort = cloth.integrator().effort();
  CHECK(effort.newton <= 200);
  CHECK(effort.residual <= 1e-6);
}

TEST_CASE("a solver that is given too few steps says so", "[particles]") {
  Scene scene(Other::kNone);
  const auto solver = scene.system->stage_solver({.tolerance = 1e-12, .newton_steps = 2});
  std::ranges::copy(scene.x.span(), scene.y.data());
  CHECK(solver->solve(0, 0.5, scene.x.data(), scene.y.data()) == StepStatus::kNotConverged);
}

TEST_CASE("bdf2 goes on from its memory as if it had never stopped") {
  Registry registry = sim_test::make_registry();
  Simulation cloth(sim_test::make_cloth(5), registry, {.integrator = "bdf2", .dt = 0.01});
  REQUIRE(sim_test::run(cloth, 7));
  const std::vector<double> memory = cloth.integrator().memory();
  CHECK(memory.size() == 1 + cloth.state().size());
  const Array now = [&] {
    Array copy(cloth.state().size());
    std::ranges::copy(cloth.state(), copy.data());
    return copy;
  }();
  REQUIRE(cloth.step());

  // Another one of the same kind, which has taken other steps before.
  Simulation other(sim_test::make_cloth(5), registry, {.integrator = "bdf2", .dt = 0.01});
  const auto method = Method(registry, "bdf2").make();
  method->prepare(other.ode());
  Array next(now.size());
  method->restart(0.07, 0.01, now.data());
  method->recall(memory);
  REQUIRE(method->step(other.ode(), 0.07, 0.01, now.data(), next.data()) == StepStatus::kDone);
  CHECK(std::ranges::equal(next.span(), cloth.state()));
  // Without its memory it starts anew, and elsewhere.
  method->restart(0.07, 0.01, now.data());
  REQUIRE(method->step(other.ode(), 0.07, 0.01, now.data(), next.data()) == StepStatus::kDone);
  CHECK_FALSE(std::ranges::equal(next.span(), cloth.state()));
}
