// Steps of springs that keep their energy, and the factors that they need.
#include "plugins/solvers/particles/discrete_gradient.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/noise.h"
#include "core/particles/springs/springs.h"
#include "tests/support/scenes.h"

using namespace sim;

namespace {

constexpr int kBeads = 12;

// A closed chain of springs of one sense; every third has no rest length.
class BeadChain final : public Force {
 public:
  BeadChain(double stiffness, SpringSense sense)
      : springs_(
            kBeads,
            [stiffness](const Springs::Visit& visit) {
              for (int i = 0; i < kBeads; ++i)
                visit(i, (i + 1) % kBeads, stiffness, i % 3 == 0 ? 0 : 0.5);
            },
            sense) {}
  const Springs* springs() const override { return &springs_; }
  double potential(const ParticleView& view, Tile tile) const override {
    return springs_.potential(view, tile);
  }

 private:
  Springs springs_;
};

struct Beads {
  explicit Beads(double stiffness, SpringSense sense, std::vector<double> all_masses)
      : masses(std::move(all_masses)), x(layout.size()) {
    Noise noise;
    for (int block = 0; block < 6; ++block)
      for (int i = 0; i < kBeads; ++i)
        layout.block(x.data(), block)[i] =
            block >= 3 && std::isinf(masses[static_cast<std::size_t>(i)]) ? 0 : noise.next();
    std::vector<std::unique_ptr<Force>> forces;
    forces.push_back(std::make_unique<BeadChain>(stiffness, sense));
    system =
        std::make_unique<Particles>(masses, std::vector<int>{}, std::move(forces), x.data(), pool);
  }
  double energy() const {
    return system->kinetic_energy(0, x.data()) + system->potential_energy(0, x.data());
  }
  Vec3 angular_momentum() const {
    const ParticleView view = system->view(0, x.data());
    Vec3 sum;
    for (int i = 0; i < kBeads; ++i) sum += view.mass[i] * view.position(i).cross(view.velocity(i));
    return sum;
  }

  const Layout layout{kBeads};
  ThreadPool pool{1};
  std::vector<double> masses;
  Array x;
  std::unique_ptr<Particles> system;
};

std::vector<double> uneven_masses() {
  std::vector<double> masses;
  for (int i = 0; i < kBeads; ++i) masses.push_back(1 + 0.5 * (i % 4));
  return masses;
}

}  // namespace

TEST_CASE("steps of springs alone keep energy and angular momentum", "[particles]") {
  for (const SpringSense sense :
       {SpringSense::kBoth, SpringSense::kTension, SpringSense::kCompression}) {
    CAPTURE(static_cast<int>(sense));
    Beads beads(50, sense, uneven_masses());
    DiscreteGradientSolver solver(*beads.system, 0, {});
    const double energy = beads.energy();
    const Vec3 momentum = beads.angular_momentum();
    for (int n = 0; n < 2000; ++n) REQUIRE(solver.step(0.1, beads.x.data()) == StepStatus::kDone);
    CHECK(beads.energy() == Approx(energy).epsilon(1e-6));
    CHECK((beads.angular_momentum() - momentum).norm() < 1e-6 * momentum.norm());
  }
}

// At h omega of 1000 lengths ring from step to step. The damping of that only lowers the energy.
TEST_CASE("steps of springs like rods gain no energy", "[particles]") {
  Beads beads(1e8, SpringSense::kBoth, uneven_masses());
  DiscreteGradientSolver solver(*beads.system, 0, {});
  double energy = beads.energy();
  for (int n = 0; n < 500; ++n) {
    REQUIRE(solver.step(0.1, beads.x.data()) == StepStatus::kDone);
    REQUIRE(beads.energy() < energy * (1 + 1e-9));
    energy = beads.energy();
  }
}

TEST_CASE("particles of infinite mass keep their velocity in steps of springs", "[particles]") {
  std::vector<double> masses = uneven_masses();
  masses[3] = masses[4] = HUGE_VAL;
  Beads beads(50, SpringSense::kBoth, masses);
  const auto v = beads.layout.axes(beads.x.data(), 3), q = beads.layout.axes(beads.x.data());
  v[1][4] = 2;
  const double before = q[1][4], rest = q[0][3];
  DiscreteGradientSolver solver(*beads.system, 0, {});
  REQUIRE(solver.step(0.1, beads.x.data()) == StepStatus::kDone);
  CHECK(q[1][4] == before + 0.1 * 2.0);
  CHECK(v[1][4] == 2);
  CHECK(q[0][3] == rest);
  CHECK(v[0][3] == 0);
}

TEST_CASE("a step of springs ends when it is stopped", "[particles]") {
  Beads beads(50, SpringSense::kBoth, uneven_masses());
  DiscreteGradientSolver solver(*beads.system, 0, [] { return true; });
  CHECK(solver.step(0.1, beads.x.data()) == StepStatus::kStopped);
}

// Blocks of noise with zeros on the diagonal, so that pivots are exchanged; the graph fills in.
TEST_CASE("factors of pivoted blocks solve to rounding, and see singular ones", "[particles]") {
  constexpr int kRows = 7;
  const std::vector<std::array<int, 2>> pairs{{0, 1}, {1, 2}, {2, 3}, {3, 4},
                                              {4, 5}, {5, 0}, {2, 5}};
  const std::vector<int> rows{3, 1, 0, 5, 2, 4, 6};
  PivotedBlockLu matrix(rows, pairs);
  REQUIRE(matrix.size() == kRows);
  matrix.clear();
  Noise noise;
  const auto block = [&](double diagonal) {
    Mat3 m;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        m(i, j) = i == j ? 0 : noise.next() + ((i + 1) % 3 == j ? diagonal : 0.0);
    return m;
  };
  std::vector<Vec3> x(kRows), b(kRows);
  for (Vec3& value : x) value = {noise.next(), noise.next(), noise.next()};
  for (int i = 0; i < kRows; ++i) {
    matrix.diagonal(i) = block(6);
    b[static_cast<std::size_t>(i)] = matrix.diagonal(i) * x[static_cast<std::size_t>(i)];
  }
  for (const auto& [one, other] : pairs) {
    const auto [low, high] =
        std::minmax(rows[static_cast<std::size_t>(one)], rows[static_cast<std::size_t>(other)]);
    const int pair = matrix.pair(low, high);
    matrix.upper(pair) = block(0);
    matrix.lower(pair) = block(0);
    b[static_cast<std::size_t>(low)] += matrix.upper(pair) * x[static_cast<std::size_t>(high)];
    b[static_cast<std::size_t>(high)] += matrix.lower(pair) * x[static_cast<std::size_t>(low)];
  }
  REQUIRE(matrix.factorise());
  matrix.solve(b);
  for (std::size_t i = 0; i < kRows; ++i) CHECK((b[i] - x[i]).norm() < 1e-12);
  matrix.clear();
  CHECK_FALSE(matrix.factorise());
}
