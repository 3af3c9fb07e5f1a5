// Runge-Kutta steps of the particle system: fused, in a wavefront, on threads.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "core/base/thread_pool.h"
#include "core/ode/explicit/embedded_pair.h"
#include "core/ode/explicit/tableau.h"
#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"

using namespace sim;

namespace {

ExplicitPlan plan_of(int stages, std::vector<double> a, std::vector<double> b,
                     std::vector<double> c) {
  return {stages, std::move(a), std::move(b), std::move(c)};
}
ExplicitPlan single(ExplicitPlan plan) {
  plan.precision = Precision::kSingle;
  return plan;
}

ExplicitPlan euler() { return plan_of(1, {0}, {1}, {0}); }
ExplicitPlan rk4() {
  return plan_of(4, {0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1, 0},
                 {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}, {0, 0.5, 0.5, 1});
}
// Kutta's 3/8 rule: every entry of a row is in use.
ExplicitPlan three_eighths() {
  return plan_of(4, {0, 0, 0, 0, 1.0 / 3, 0, 0, 0, -1.0 / 3, 1, 0, 0, 1, -1, 1, 0},
                 {0.125, 0.375, 0.375, 0.125}, {0, 1.0 / 3, 2.0 / 3, 1});
}

// Stages in every relation to each other that a pair may have; accurate it is not.
constexpr EmbeddedPair<3, 2> kPair{
    .method = {.a = {{{}, {0.5}, {-0.25, 1}}}, .b = {0.2, 0.3, 0.5}, .c = {0, 0.5, 0.75}},
    .error = {0.1, -0.2, 0.3, -0.2},
    .extra_a = {{{0.1, 0.2, -0.1, 0.1}, {0.3, -0.1, 0.1, 0.2, 0.1}}},
    .extra_c = {0.3, 0.6}};

class ClothSprings final : public Force {
 public:
  ClothSprings(int n, bool jitter) : n_(n), jitter_(jitter) {}
  void bind(const ParticleView& initial) override {
    springs_.emplace(initial.n, [&](const Springs::Visit& visit) {
      const int offsets[6][2] = {{0, 1}, {1, 0}, {1, 1}, {1, -1}, {0, 2}, {2, 0}};
      for (const auto& [di, dj] : offsets)
        for (int i = 0; i + di < n_; ++i)
          for (int j = std::max(0, -dj); j < n_ && j + dj < n_; ++j) {
            const int a = i * n_ + j;
            visit(a, (i + di) * n_ + j + dj, 50,
                  std::hypot(di, dj) + (jitter_ ? 1e-3 * (a % 7) : 0));
          }
    });
  }
  const Springs* springs() const override { return &*springs_; }

 private:
  int n_;
  bool jitter_;
  std::optional<Springs> springs_;
};

class AffineGravityDrag final : public Force {
 public:
  std::optional<AffineForce> affine() const override { return AffineForce{{0.1, -9.81, 0}, 0.02}; }
};

// Depends on time, and on the position and velocity of another particle.
class Follower final : public Force {
 public:
  void accumulate(const ParticleView& p, Tile tile, ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) {
      const int other = p.n - 1 - i;
      sink.x[i] += 0.1 * (p.x[other] - p.x[i]) - 0.05 * p.vx[other];
      sink.y[i] += std::cos(p.t) - 0.03 * p.vy[i] * p.vy[i];
    }
  }
};

struct Scene {
  int n;
  bool jitter = false, follower = false, masses = false;
};

class Runner {
 public:
  Runner(const Scene& scene, int threads) : pool_(threads), layout_(scene.n * scene.n) {
    const int count = layout_.n();
    x_ = Array(layout_.size());
    next_ = Array(layout_.size());
    for (int i = 0; i < count; ++i) {
      layout_.block(x_.data(), 0)[i] = i % scene.n + 0.1 * std::sin(i);
      layout_.block(x_.data(), 1)[i] = 0.2 * std::cos(3 * i);
      layout_.block(x_.data(), 2)[i] = i / scene.n;
      if (i != 0 && i != scene.n - 1) layout_.block(x_.data(), 3)[i] = 0.3 * std::sin(5 * i);
    }
    std::vector<double> masses(static_cast<std::size_t>(count), 0.5);
    if (scene.masses)
      for (int i = 0; i < count; ++i) masses[static_cast<std::size_t>(i)] += 0.01 * (i % 11);
    std::vector<std::unique_ptr<Force>> forces;
    forces.push_back(std::make_unique<AffineGravityDrag>());
    forces.push_back(std::make_unique<ClothSprings>(scene.n, scene.jitter));
    if (scene.follower) forces.push_back(std::make_unique<Follower>());
    system_ = std::make_unique<ParticleSystem>(masses, std::vector<int>{0, scene.n - 1},
                                               std::move(forces), x_.data(), pool_);
  }

  // The output of a pair over some steps: each state, and a combination of all stages of the step.
  std::vector<double> run_pair(int steps, bool fused) {
    const EmbeddedPlan plan(kPair);
    const auto stepper =
        fused ? system_->embedded_stepper(plan) : system_->OdeSystem::embedded_stepper(plan);
    const double h = 0.01, weights[] = {1, -2, 0.5, 3, 0, -1.5};
    std::vector<double> values;
    Array sum(layout_.size());
    REQUIRE(stepper->start(0, x_.data()));
    for (int i = 0; i < steps; ++i) {
      REQUIRE(stepper->step(h * i, h, x_.data(), next_.data()));
      REQUIRE(stepper->close(h * (i + 1), next_.data()));
      stepper->extend(h * i, h, x_.data());
      stepper->combine(x_.data(), h, weights, next_.data(), sum.data());
      stepper->shift();
      append(next_, values);
      append(sum, values);
      std::swap(x_, next_);
    }
    return values;
  }

  // The result of a step, and of the next step from the same state.
  std::pair<std::vector<double>, std::vector<double>> step_twice(const ExplicitPlan& plan) {
    const auto stepper = system_->explicit_stepper(plan);
    std::pair<std::vector<double>, std::vector<double>> values;
    for (std::vector<double>* each : {&values.first, &values.second}) {
      REQUIRE(stepper->step(0, 0.01, 1, x_.data(), next_.data()));
      append(next_, *each);
    }
    return values;
  }

  // The steps after this are made on one thread, on two .. on all of them, and on one again.
  void use_in_turn() { in_turn_ = true; }

  // The positions and velocities after some steps, fused or stage by stage.
  std::vector<double> run(const ExplicitPlan& plan, int steps, bool fused) {
    if (in_turn_) pool_.use(1);
    const auto stepper =
        fused ? system_->explicit_stepper(plan) : system_->OdeSystem::explicit_stepper(plan);
    for (int i = 0; i < steps; ++i) {
      if (in_turn_) pool_.use(1 + i % pool_.most());
      REQUIRE(stepper->step(0.01 * i, 0.01, 1, x_.data(), next_.data()));
      std::swap(x_, next_);
    }
    std::vector<double> values;
    append(x_, values);
    return values;
  }

 private:
  void append(const Array& state, std::vector<double>& values) const {
    for (int block = 0; block < 6; ++block)
      values.insert(values.end(), layout_.block(state.data(), block),
                    layout_.block(state.data(), block) + layout_.n());
  }

  ThreadPool pool_;
  bool in_turn_ = false;
  Layout layout_;
  Array x_, next_;
  std::unique_ptr<ParticleSystem> system_;
};

std::vector<double> result(const Scene& scene, const ExplicitPlan& plan, int steps, bool fused,
                           int threads = 1) {
  return Runner(scene, threads).run(plan, steps, fused);
}

double worst_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::fabs(a[i] - b[i]));
  return worst;
}

const Scene kScenes[] = {
    {5}, {8}, {12, true}, {9, false, true}, {8, true, true, true}, {7, false, false, true}};

}  // namespace

TEST_CASE("the stages of a pair on particles are those of its definition", "[particles]") {
  for (const Scene& scene : kScenes) {
    INFO(scene.n << " x " << scene.n);
    const std::vector<double> fused = Runner(scene, 1).run_pair(4, true);
    const std::vector<double> plain = Runner(scene, 1).run_pair(4, false);
    const double size =
        std::fabs(*std::max_element(plain.begin(), plain.end(), [](double a, double b) {
          return std::fabs(a) < std::fabs(b);
        }));
    CHECK(worst_difference(fused, plain) < 1e-13 * size);
    CHECK(fused == Runner(scene, 3).run_pair(4, true));
  }
}

TEST_CASE("the fused step is the step of the tableau", "[particles]") {
  for (const Scene& scene : kScenes)
    for (const ExplicitPlan& plan : {euler(), rk4(), three_eighths()})
      // Positions up to 12 and velocities up to 10 over 20 steps: some hundred roundings.
      CHECK(worst_difference(result(scene, plan, 20, true), result(scene, plan, 20, false)) <
            1e-12);
}

TEST_CASE("a step in single precision is that of the tableau to its 24 bits", "[particles]") {
  // Runs of every stride below 17 and more. Positions up to n are rounded by 6e-8 n, accelerations
  // by 100 / s^2 times that for each of 12 springs: 7e-6 n m/s in 10 steps.
  std::vector<Scene> scenes;
  for (const int n : {3, 4, 5, 6, 7, 8, 9, 11, 13, 15, 16, 17, 23, 33, 100})
    scenes.push_back({n, n % 2 == 0, false, n % 3 == 0});
  for (const Scene& scene : scenes)
    for (const ExplicitPlan& plan : {euler(), rk4(), three_eighths()}) {
      INFO(scene.n << " x " << scene.n);
      const std::vector<double> values = result(scene, single(plan), 10, true);
      const double difference = worst_difference(values, result(scene, plan, 10, false));
      CHECK(difference > 1e-9);
      CHECK(difference < 2e-5 * scene.n);
      for (const double value : values)
        REQUIRE(value == static_cast<double>(static_cast<float>(value)));
    }
}

TEST_CASE("a wavefront is the step of the tableau", "[particles]") {
  // 100 x 100 particles go in one pass over all stages; coordinates up to 100 have roundings of
  // 1e-14.
  CHECK(worst_difference(result({100}, rk4(), 5, true), result({100}, rk4(), 5, false)) < 3e-12);
}

TEST_CASE("threads do not change a bit of a step", "[particles]") {
  for (const Scene& scene :
       {Scene{100}, Scene{64}, Scene{100, true, false, true}, Scene{60, false, true}})
    for (const ExplicitPlan& plan : {euler(), rk4(), three_eighths(), single(rk4())}) {
      if (plan.precision == Precision::kSingle && scene.follower) continue;
      const std::vector<double> one = result(scene, plan, 6, true);
      for (const int threads : {2, 3, 4, 7}) CHECK(result(scene, plan, 6, true, threads) == one);
    }
}

TEST_CASE("the number of threads may change from step to step", "[particles]") {
  for (const Scene& scene : {Scene{100}, Scene{60, false, true}}) {
    Runner runner(scene, 4);
    runner.use_in_turn();
    CHECK(runner.run(rk4(), 6, true) == result(scene, rk4(), 6, true));
  }
}

TEST_CASE("a step depends on the state that is given, whichever was made last", "[particles]") {
  for (const ExplicitPlan& plan : {rk4(), single(rk4())}) {
    const auto [once, again] = Runner({9}, 1).step_twice(plan);
    CHECK(once == again);
  }
}

TEST_CASE("a step that leaves the finite numbers says so", "[particles]") {
  ThreadPool pool(1);
  const Layout layout(16);
  Array x(layout.size()), next(layout.size());
  for (int i = 0; i < 16; ++i) layout.block(x.data(), 0)[i] = i;
  layout.block(x.data(), 3)[5] = 1e308;
  std::vector<std::unique_ptr<Force>> forces;
  forces.push_back(std::make_unique<ClothSprings>(4, false));
  ParticleSystem system(std::vector<double>(16, 1.0), {}, std::move(forces), x.data(), pool);
  const auto stepper = system.explicit_stepper(rk4());
  CHECK(stepper->step(0, 1e-3, 1, x.data(), next.data()));
  CHECK_FALSE(stepper->step(0, 1e3, 1, x.data(), next.data()));
}
