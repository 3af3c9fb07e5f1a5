// The Jacobian that particle systems offer, against differences of their right-hand side.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/geometry/triangle_mesh.h"
#include "core/particles/particle_jacobian.h"
#include "core/particles/particle_system.h"
#include "core/particles/springs/spring_stiffness.h"
#include "core/particles/springs/springs.h"
#include "plugins/solvers/particles/stage_matrix.h"
#include "tests/support/scenes.h"

using namespace sim;

namespace {

// J dx of the system itself and by differences, largest difference relative to the largest entry.
double disagreement(OdeSystem& system, const Array& x, const Array& dx) {
  Array exact(x.size()), differences(x.size());
  const auto own = system.jacobian();
  own->at(0.3, x.data());
  own->apply(dx.data(), exact.data());
  const auto other = difference_jacobian(system);
  other->at(0.3, x.data());
  other->apply(dx.data(), differences.data());
  double worst = 0, size = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    worst = std::max(worst, std::abs(exact[i] - differences[i]));
    size = std::max(size, std::abs(exact[i]));
  }
  REQUIRE(size > 0);
  return worst / size;
}

struct Tie {
  int a, b;
  double k, rest;
};

class TiedSprings final : public Force {
 public:
  explicit TiedSprings(std::vector<Tie> ties) : ties_(std::move(ties)) {}
  void bind(const ParticleView& initial) override {
    springs_.emplace(initial.n, [&](const Springs::Visit& visit) {
      for (const Tie& tie : ties_) visit(tie.a, tie.b, tie.k, tie.rest);
    });
  }
  const Springs* springs() const override { return &*springs_; }

 private:
  std::vector<Tie> ties_;
  std::optional<Springs> springs_;
};

class AffineGravityDrag final : public Force {
 public:
  std::optional<AffineForce> affine() const override { return AffineForce{{0.1, -9.81, 0}, 0.4}; }
};

// Depends on time, and on the position and velocity of another particle; not symmetric.
class Follower final : public Force {
 public:
  explicit Follower(bool blocks) : blocks_(blocks) {}

  void accumulate(const ParticleView& p, Tile tile, ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) {
      const int j = p.n - 1 - i;
      sink.x[i] += 3 * (p.x[j] - p.x[i]) - 0.5 * p.vx[j];
      sink.y[i] += p.t - 0.3 * p.vy[i] * p.vy[i];
    }
  }
  bool has_jacobian() const override { return blocks_; }
  void jacobian(const ParticleView& p, JacobianSink& sink) const override {
    for (int i = 0; i < p.n; ++i) {
      const int j = p.n - 1 - i;
      sink.position(i, j, Mat3::Diagonal({3, 0, 0}));
      sink.position(i, i, Mat3::Diagonal({-3, 0, 0}));
      sink.velocity(i, j, Mat3::Diagonal({-0.5, 0, 0}));
      sink.velocity(i, i, Mat3::Diagonal({0, -0.6 * p.vy[i], 0}));
    }
  }

 private:
  bool blocks_;
};

enum class Other { kNone, kBlocks, kDifferences };

// Springs in runs and in a net, some stretched, some compressed to a third, some of rest length 0.
struct Scene {
  static constexpr int kParticles = 60;
  ThreadPool pool;
  Layout layout{kParticles};
  Array x{layout.size()}, dx{layout.size()};
  std::unique_ptr<ParticleSystem> system;

  Scene(int threads, Other other, double amplitude = 1) : pool(threads) {
    for (int block = 0; block < 6; ++block)
      for (int i = 0; i < kParticles; ++i) {
        layout.block(x.data(), block)[i] = std::sin(1.0 + 3 * i + 7 * block);
        layout.block(dx.data(), block)[i] = amplitude * std::cos(2.0 + 5 * i + 3 * block);
      }
    for (const int pinned : {0, 17})
      for (int block = 3; block < 6; ++block) {
        layout.block(x.data(), block)[pinned] = 0;
        layout.block(dx.data(), block)[pinned] = 0;
      }
    std::vector<Tie> ties;
    for (int i = 0; i + 1 < kParticles; ++i) ties.push_back({i, i + 1, 40, 0.2 + 0.1 * (i % 30)});
    for (int i = 0; i + 9 < kParticles; ++i) ties.push_back({i, i + 9, 7, 0});
    for (int i = 0; i < 20; ++i) ties.push_back({i, (i * i + 31) % 29 + 30, 11, 1.5});
    std::vector<double> masses(kParticles);
    for (int i = 0; i < kParticles; ++i) masses[static_cast<std::size_t>(i)] = 1 + 0.1 * (i % 7);
    std::vector<std::unique_ptr<Force>> forces;
    forces.push_back(std::make_unique<AffineGravityDrag>());
    forces.push_back(std::make_unique<TiedSprings>(ties));
    if (other != Other::kNone)
      forces.push_back(std::make_unique<Follower>(other == Other::kBlocks));
    system = std::make_unique<ParticleSystem>(masses, std::vector<int>{0, 17}, std::move(forces),
                                              x.data(), pool);
    REQUIRE_FALSE(system->forces()[1]->springs()->runs().empty());
    REQUIRE_FALSE(system->forces()[1]->springs()->net().empty());
  }
};

}  // namespace

TEST_CASE("the Jacobian of particles agrees with differences", "[particles]") {
  for (const Other other : {Other::kNone, Other::kBlocks, Other::kDifferences}) {
    Scene scene(1, other);
    CHECK(disagreement(*scene.system, scene.x, scene.dx) <= 1e-8);
  }
}

TEST_CASE("the matrix of a stage is that of the Jacobian, its diagonal too", "[particles]") {
  for (const Other other : {Other::kNone, Other::kBlocks, Other::kDifferences})
    for (const int threads : {1, 3}) {
      Scene scene(threads, other);
      const double tau = 0.3;
      const ParticleView view = scene.system->view(0.3, scene.x.data());
      StageMatrix matrix(*scene.system);
      matrix.at(view, tau, {});
      const auto jacobian = scene.system->jacobian();
      jacobian->at(0.3, scene.x.data());

      // A p = m (p - tau a) with the accelerations a that J has for dq = tau p, dv = p.
      Array p(matrix.layout().size()), out(p.size()), dx(scene.layout.size()), rate(dx.size());
      const auto expected = [&](int i, int axis) {
        return view.mass[i] * (matrix.layout().block(p.data(), axis)[i] -
                               tau * scene.layout.block(rate.data(), 3 + axis)[i]);
      };
      const auto apply = [&] {
        for (int axis = 0; axis < 3; ++axis)
          for (int i = 0; i < view.n; ++i) {
            const double value = matrix.layout().block(p.data(), axis)[i];
            scene.layout.block(dx.data(), axis)[i] = tau * value;
            scene.layout.block(dx.data(), 3 + axis)[i] = value;
          }
        matrix.apply(p.data(), out.data());
        jacobian->apply(dx.data(), rate.data());
      };
      for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < view.n; ++i)
          matrix.layout().block(p.data(), axis)[i] = view.free(i) ? std::sin(2.0 * i + axis) : 0;
      apply();
      // Differences are good to 1e-8.
      const double margin = other == Other::kDifferences ? 1e-6 : 1e-11;
      for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < view.n; ++i)
          if (view.free(i))
            CHECK(matrix.layout().block(out.data(), axis)[i] ==
                  Approx(expected(i, axis)).margin(margin));
      if (other == Other::kDifferences) continue;
      for (int i = 0; i < view.n; ++i)
        for (int column = 0; column < 3 && view.free(i); ++column) {
          std::ranges::fill(p.span(), 0.0);
          matrix.layout().block(p.data(), column)[i] = 1;
          apply();
          for (int row = 0; row < 3; ++row)
            CHECK(matrix.diagonal(i)(row, column) == Approx(expected(i, row)).margin(margin));
        }
    }
}

TEST_CASE("every spring is visited once with its stiffness", "[particles]") {
  Scene scene(1, Other::kNone);
  const ParticleView view = scene.system->view(0, scene.x.data());
  const double* const q[3] = {view.x, view.y, view.z};
  Stiffness stiffness(*scene.system);
  stiffness.at(q, {});
  // The sums of |K| over the springs of each particle, against those of the springs themselves.
  std::vector<double> found(Scene::kParticles), expected(Scene::kParticles);
  const auto size = [](const SpringStiffness& s) { return s.along * s.along + std::abs(s.across); };
  int springs = 0;
  stiffness.for_each([&](int a, int b, const SpringStiffness& spring) {
    CHECK(a < b);
    ++springs;
    found[static_cast<std::size_t>(a)] += size(spring);
    found[static_cast<std::size_t>(b)] += size(spring);
  });
  CHECK(springs == scene.system->forces()[1]->springs()->count());
  for (int i = 0; i < Scene::kParticles; ++i)
    scene.system->forces()[1]->springs()->at(i, [&](int to, double k, double rest) {
      expected[static_cast<std::size_t>(i)] +=
          size(spring_stiffness(view.position(i) - view.position(to), k, rest));
    });
  for (std::size_t i = 0; i < found.size(); ++i) CHECK(found[i] == Approx(expected[i]));
}

TEST_CASE("the Jacobian does not depend on threads", "[particles]") {
  for (const Other other : {Other::kNone, Other::kBlocks, Other::kDifferences}) {
    Scene one(1, other), three(3, other);
    Array f1(one.x.size()), f3(one.x.size());
    for (auto& [scene, f] : {std::pair(&one, &f1), std::pair(&three, &f3)}) {
      const auto jacobian = scene->system->jacobian();
      jacobian->at(0, scene->x.data());
      jacobian->apply(scene->dx.data(), f->data());
    }
    CHECK(std::ranges::equal(f1.span(), f3.span()));
  }
}

TEST_CASE("differences of forces suit directions of any size", "[particles]") {
  Scene unit(1, Other::kDifferences), tiny(1, Other::kBlocks, 1e-9);
  Array expected(unit.x.size()), found(unit.x.size());
  const auto blocks = tiny.system->jacobian(), differences = unit.system->jacobian();
  blocks->at(0, tiny.x.data());
  differences->at(0, unit.x.data());
  blocks->apply(tiny.dx.data(), expected.data());
  differences->apply(tiny.dx.data(), found.data());
  for (std::size_t i = 0; i < found.size(); ++i)
    CHECK(found[i] == Approx(expected[i]).margin(1e-8 * 1e-9));
}

TEST_CASE("every force of this build has a Jacobian that agrees with differences") {
  Registry registry = sim_test::make_registry();
  for (const std::string& name : registry.names<Force>()) {
    const ForcePlugin& plugin = registry.get<sim::Force>(name);
    SystemSpec spec =
        sim_test::make_chain({{0, 0, 0}, {1, 0, 0}, {1.5, 0.8, 0}, {0.5, 0.6, 1}}, {0}, 0.1);
    for (ParticleSpec& particle : spec.particles->list) particle.velocity = {0.3, -0.2, 0.4};
    std::map<std::string, Value> given = plugin.example;
    for (const Param& param : plugin.params) {
      if (param.required && param.type == ParamType::kSurface)
        given[param.name] = std::make_shared<const TriangleMesh>(
            4, std::vector<TriangleMesh::Triangle>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
      if (param.required && param.type == ParamType::kNumber)
        given[param.name] = std::clamp(2.0, param.min, param.max);
      if (param.type == ParamType::kNumber && param.name == "stiffness") given["stiffness"] = 30.0;
      if (param.required && param.type == ParamType::kParticleFunction)
        given[param.name] = ParticleFunction(
            [](const ParticleView& p, std::span<const int> ids, std::span<double> out) {
              for (std::size_t k = 0; k < out.size(); ++k)
                out[k] = p.x[ids[k / 3]] * (1 - p.vy[ids[k / 3]]);
            });
    }
    spec.forces.push_back(sim_test::make_part(name, given));
    if (plugin.elements.arity == 2) {
      spec.forces.back().elements.add({0, 2}, {{"rest", 2.5}});
      spec.forces.back().elements.add({1, 3}, {{"rest", 0}});
    }
    Simulation simulation(spec, registry);
    const std::size_t size = simulation.state().size();
    Array x(size), dx(size);
    std::ranges::copy(simulation.state(), x.data());
    const Layout layout(4);
    for (int block = 0; block < 6; ++block)
      for (int i = 1; i < 4; ++i) layout.block(dx.data(), block)[i] = std::sin(1.0 + i + 4 * block);
    INFO(name);
    CHECK(disagreement(simulation.ode(), x, dx) <= 1e-7);
  }
}

TEST_CASE("the stiffness of a spring at its singular points", "[particles]") {
  // k I where the rest length is 0 or where a spring without length has no direction.
  for (const Vec3& d : {Vec3(0.3, -1, 2), Vec3(0, 0, 0), Vec3(1e-200, 0, 0), Vec3(1e200, 1e200, 0)})
    CHECK((spring_stiffness(d, 3, 0).along == 3 && spring_stiffness(d, 3, 0).across == 0));
  CHECK((spring_stiffness(Vec3::Zero(), 3, 1).along == 3));
  CHECK((spring_stiffness(Vec3::Zero(), 3, 1).across == 0));
  CHECK((spring_stiffness({1e200, 0, 0}, 3, 1).along == 3));
  // Along the spring always k; across it k (1 - r/|d|), negative when compressed.
  const auto [along, across] = spring_stiffness({0, 0.5, 0}, 3, 2);
  CHECK(along == Approx(-9).epsilon(1e-15));
  CHECK(along + across * 0.25 == Approx(3).epsilon(1e-15));
}
