// The partition of springs into stiff and soft, where modes have closed forms.
#include "plugins/solvers/particles/stiff_part.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/slot.h"
#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"

using namespace sim;

namespace {

struct Tie {
  int a, b;
  double k;
};

class Ties final : public Force {
 public:
  Ties(int n, const std::vector<Tie>& ties)
      : springs_(n, [&](const Springs::Visit& visit) {
          for (const Tie& each : ties) visit(each.a, each.b, each.k, 1);
        }) {}
  const Springs* springs() const override { return &springs_; }
  double potential(const ParticleView& view, Tile tile) const override {
    return springs_.potential(view, tile);
  }
  bool conservative() const override { return true; }

 private:
  Springs springs_;
};

// -decay m v on each particle, and -omega^2 m x, whose Gershgorin rows have sqrt(3) times that.
class Field final : public Force {
 public:
  Field(double omega, double decay) : omega_(omega), decay_(decay) {}
  void accumulate(const ParticleView& view, Tile tile, ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i)
      sink.add(i, -view.mass[i] * (omega_ * omega_ * view.position(i) + decay_ * view.velocity(i)));
  }
  bool depends_on_velocity() const override { return decay_ > 0; }
  bool has_jacobian() const override { return true; }
  void jacobian(const ParticleView& view, JacobianSink& sink) const override {
    for (int i = 0; i < view.n; ++i) {
      sink.position(i, i, -view.mass[i] * omega_ * omega_ * Mat3::Identity());
      if (decay_ > 0) sink.velocity(i, i, -view.mass[i] * decay_ * Mat3::Identity());
    }
  }

 private:
  double omega_, decay_;
};

// Particles of mass m, 1 m apart along x.
struct Masses {
  static constexpr double kMass = 0.5, kStep = 0.016;  // kg; s: soft modes have 1.6 / h = 100 rad/s
  ThreadPool pool{1};
  Array state;
  std::unique_ptr<ParticleSystem> system;
  Partition partition;

  Masses(int n, std::vector<std::vector<Tie>> forces, std::vector<std::optional<bool>> wishes = {},
         std::vector<std::pair<double, double>> fields = {}) {
    const Layout layout(n);
    state = Array(layout.size());
    for (int i = 0; i < n; ++i) layout.block(state.data(), 0)[i] = i;
    std::vector<std::unique_ptr<Force>> all;
    for (const std::vector<Tie>& ties : forces) all.push_back(std::make_unique<Ties>(n, ties));
    for (const auto& [omega, decay] : fields) all.push_back(std::make_unique<Field>(omega, decay));
    system =
        std::make_unique<ParticleSystem>(std::vector<double>(slot(n), kMass), std::vector<int>{},
                                         std::move(all), state.data(), pool);
    StiffPart part(*system, [=, this](const Force& force) -> std::optional<bool> {
      for (std::size_t i = 0; i < wishes.size(); ++i)
        if (system->forces()[i] == &force) return wishes[i];
      return {};
    });
    partition = part.choose(0, kStep, state.data());
    counted = part.count(partition);
    ends = part.stiff_particles(partition);
    check_sum(part);
  }

  // The accelerations by the soft part and by the stiff one are those of all, at any state.
  void check_sum(const StiffPart& part) {
    const Layout& layout = system->layout();
    Array x(layout.size()), sums[3] = {Array(x.size()), Array(x.size()), Array(x.size())};
    for (int i = 0; i < layout.n(); ++i)
      for (int block = 0; block < 6; ++block)
        layout.block(x.data(), block)[i] =
            layout.block(state.data(), block)[i] + 0.1 * std::sin(1 + 7 * i + 3 * block);
    const auto soft = part.soft_system(partition, x.data());
    const auto stiff = part.stiff_system(partition, {}, x.data(), pool);
    Particles* const of[3] = {system.get(), soft.get(), stiff.get()};
    for (int k = 0; k < 3; ++k) {
      const auto a = layout.axes(sums[k].data(), 3);
      of[k]->accelerate(of[k]->view(0, x.data()), a.data());
    }
    const auto last = static_cast<std::ptrdiff_t>(layout.n() - 1);
    stiffly = layout.block(sums[2].data(), 3)[last] / layout.block(sums[0].data(), 3)[last];
    for (int i = 0; i < layout.n(); ++i)
      for (int block = 3; block < 6; ++block)
        CHECK(
            layout.block(sums[0].data(), block)[i] ==
            Approx(layout.block(sums[1].data(), block)[i] + layout.block(sums[2].data(), block)[i])
                .margin(1e-8));
  }

  PartitionCount counted;
  std::vector<int> ends;
  double stiffly = 0;  // the share of the acceleration of the last particle that is stiff
};

// A spring between two particles of mass m has omega = sqrt(2 k / m) and is alone in its mode.
double stiffness(double omega) { return 0.5 * Masses::kMass * omega * omega; }

// Pairs (0, 1), (2, 3), .. of these rates.
Masses pairs(const std::vector<double>& rates, std::vector<std::optional<bool>> wishes = {}) {
  std::vector<Tie> ties;
  for (int i = 0; const double each : rates) {
    ties.push_back({i, i + 1, stiffness(each)});
    i += 2;
  }
  return Masses(static_cast<int>(2 * rates.size()), {ties}, std::move(wishes));
}

}  // namespace

TEST_CASE("springs beyond the limit of the step are stiff, and no others", "[particles]") {
  CHECK(pairs({99.9, 5, 50}).counted.none());
  CHECK(pairs({99.9, 5, 50}).ends.empty());
  const Masses row = pairs({7, 110, 5, 99, 8});
  CHECK(row.counted.springs == 5);
  CHECK(row.counted.stiff_springs == 1);
  CHECK(row.counted.fastest_stiff == Approx(110));
  CHECK(row.ends == std::vector<int>{2, 3});
  CHECK(row.partition.cut == Approx(100));
  CHECK(row.partition.step == Masses::kStep);
  // Half of them may be stiff; where more would be, all are, but for trees far above the rest.
  CHECK(pairs({200, 110, 5, 99}).counted.stiff_springs == 2);
  CHECK(pairs({200, 110, 60}).counted.stiff_springs == 3);
  CHECK(pairs({200, 110, 40}).counted.stiff_springs == 2);
  CHECK(pairs({200}).counted.stiff_springs == 1);
}

// A chain of n equal springs of omega each has the mode 2 sqrt(k / m) sin(n pi / (2 (n + 1))), up
// to sqrt(2) omega.
TEST_CASE("springs that are fast together are stiff together", "[particles]") {
  for (const double omega : {60.0, 75.0, 90.0}) {
    std::vector<Tie> ties;
    for (int i = 0; i < 6; ++i) ties.push_back({i, i + 1, stiffness(omega)});
    for (int i = 0; i < 8; ++i) ties.push_back({7 + 2 * i, 8 + 2 * i, stiffness(10 + i)});
    const Masses row(23, {ties});
    const double fastest = std::sqrt(2.0) * omega * std::cos(std::acos(-1.0) / 14);
    INFO(omega << ", together " << fastest);
    CHECK(row.counted.stiff_springs == (fastest > 100 ? 6 : 0));
    CHECK(row.ends.size() == (fastest > 100 ? 7 : 0));
    if (fastest > 100) {
      // The highest threshold below, of eight to each factor of 2.
      CHECK(row.partition.cut == Approx(std::exp2(std::floor(8 * std::log2(omega)) / 8)));
    }
  }
}

TEST_CASE("what a scene says of a force holds whatever its springs are", "[particles]") {
  const std::vector<Tie> slow{{0, 1, stiffness(5)}}, fast{{2, 3, stiffness(300)}},
      others{{4, 5, stiffness(120)}, {6, 7, stiffness(20)}, {8, 9, stiffness(20)}};
  const auto stiff = [&](std::vector<std::optional<bool>> wishes) {
    return Masses(10, {slow, fast, others}, std::move(wishes)).ends;
  };
  CHECK(stiff({}) == std::vector<int>{2, 3, 4, 5});
  CHECK(stiff({true}) == std::vector<int>{0, 1, 2, 3, 4, 5});
  // Nothing else has to be where that is enough.
  const Masses enough(6, {slow, fast, {{4, 5, stiffness(90)}}}, {{}, true});
  CHECK(enough.ends == std::vector<int>{2, 3});
  CHECK(enough.partition.cut == HUGE_VAL);
  CHECK(stiff({{}, true}) == std::vector<int>{2, 3, 4, 5});
  CHECK(stiff({true, true, false}) == std::vector<int>{0, 1, 2, 3});
  // Nothing helps what is kept soft beyond the limit: the others are as they would be.
  CHECK(stiff({{}, false}) == std::vector<int>{4, 5});
  CHECK(stiff({false, false, false}).empty());
}

// Rates of forces that accumulate: sqrt(row sums of K / m), half the decay of velocities; a block
// counts by its norm, sqrt(3) of a multiple of the unit matrix.
TEST_CASE("forces without springs are stiff as a whole where they are fast", "[particles]") {
  const auto stiff = [](double omega, double decay) {
    const Masses row(3, {{{0, 1, stiffness(5)}}}, {}, {{omega, decay}});
    CHECK(row.counted.stiff_springs == 0);
    CHECK(row.stiffly == static_cast<double>(row.counted.stiff_forces));
    return row.counted.stiff_forces;
  };
  CHECK(stiff(99.8, 0) == 0);
  CHECK(stiff(101, 0) == 1);
  CHECK(stiff(1, 199) == 0);
  CHECK(stiff(1, 202) == 1);
  // Two that are too fast together, sqrt(70^2 + 75^2) = 102.6: the faster one is enough.
  const Masses two(3, {{{0, 1, stiffness(5)}}}, {}, {{70, 0}, {75, 0}});
  CHECK(two.counted.stiff_forces == 1);
  CHECK(two.stiffly == Approx(75.0 * 75 / (70 * 70 + 75 * 75)));
}
