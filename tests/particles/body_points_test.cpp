// Forces and constraints on points of bodies against plain loops over the points' weights.
#include "core/particles/rigid/body_points.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "core/base/slot.h"
#include "core/base/thread_pool.h"
#include "core/particles/breakable.h"
#include "core/particles/springs/springs.h"

using namespace sim;

namespace {

constexpr int kParticles = 11;
const std::vector<JointNode> kPoints{{1, {7}, {1}},
                                     {4, {0, 1, 2, 3}, {0.4, 0.3, 0.2, 0.1}},
                                     {4, {3, 4, 5, 6}, {-0.5, 0.25, 0.5, 0.75}},
                                     {1, {2}, {1}}};

// Particles anywhere, with any velocities.
struct Cloud {
  std::vector<double> numbers[6], mass;
  ParticleView view;

  explicit Cloud(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (std::vector<double>& each : numbers)
      for (int i = 0; i < kParticles; ++i) each.push_back(uniform(random));
    for (int i = 0; i < kParticles; ++i) mass.push_back(1 + i);
    view.n = kParticles;
    view.t = 0.25 * seed;
    view.x = numbers[0].data(), view.y = numbers[1].data(), view.z = numbers[2].data();
    view.vx = numbers[3].data(), view.vy = numbers[4].data(), view.vz = numbers[5].data();
    view.mass = mass.data();
  }
  Vec3 of_point(std::size_t k, bool velocity) const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t p = 0; p < slot(kPoints[k].count); ++p) {
      const int id = kPoints[k].ids[p];
      sum += kPoints[k].weights[p] * (velocity ? view.velocity(id) : view.position(id));
    }
    return sum;
  }
};

// Properties of a force of the tests; its points have the stiffness 1, 2, .. N/m to the origin.
struct PullKind {
  bool springs = false, damps = false, conservative = false, breaks = false;
};
constexpr double kDamping = 0.5;  // kg/s of the first point

class Pull final : public Force, public Breakable {
 public:
  Pull(PullKind kind, ParticleView* seen) : kind_(kind), seen_(seen) {}

  void bind(const ParticleView& initial) override {
    *seen_ = initial;
    if (kind_.springs) make_springs(3);
  }
  void prepare(const ParticleView& view, ThreadPool&) override { *seen_ = view; }
  void accumulate(const ParticleView& view, Tile tile, ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) {
      if (!kind_.springs) sink.add(i, -(1.0 + i) * view.position(i));
      if (kind_.damps) sink.add(i, -kDamping * (1 + i) * view.velocity(i));
    }
  }
  const Springs* springs() const override { return springs_.get(); }
  bool accumulates() const override { return !kind_.springs || kind_.damps; }
  bool depends_on_velocity() const override { return kind_.damps; }
  bool conservative() const override { return kind_.conservative; }
  bool has_dissipative_part() const override { return kind_.damps && !kind_.springs; }
  void dissipative_part(const ParticleView& view, Tile tile, ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) sink.add(i, -kDamping * (1 + i) * view.velocity(i));
  }
  double potential(const ParticleView& view, Tile tile) const override {
    double sum = 0;
    for (int i = tile.begin; i < tile.end; ++i)
      sum += 0.5 * (1 + i) * view.position(i).squaredNorm();
    return sum;
  }
  Breakable* breakable() override { return kind_.breaks ? this : nullptr; }
  int ties() const override { return 3; }
  std::array<int, 2> ends(int tie) const override { return {tie, tie + 1}; }
  double energy(const ParticleView& view, int tie) const override { return view.x[tie]; }
  void find_overloaded(const ParticleView& view, std::span<const double>,
                       std::vector<int>& ties) const override {
    for (int i = 0; i < 3; ++i)
      if (view.x[i] > 0) ties.push_back(i);
  }
  void set_broken(std::span<const int> ties) override {
    make_springs(3 - static_cast<int>(ties.size()));
  }

 private:
  // From each point to the next, 10 (i + 1) N/m.
  void make_springs(int count) {
    springs_ = std::make_unique<Springs>(4, [&](const Springs::Visit& visit) {
      for (int i = 0; i < count; ++i) visit(i, i + 1, 10.0 * (i + 1), 0.3);
    });
  }
  PullKind kind_;
  ParticleView* seen_;
  std::unique_ptr<Springs> springs_;
};

// A force on each particle, by loops.
std::vector<Vec3> shared_out(const std::vector<Vec3>& on_points) {
  std::vector<Vec3> forces(kParticles, Vec3::Zero());
  for (std::size_t k = 0; k < kPoints.size(); ++k)
    for (std::size_t p = 0; p < slot(kPoints[k].count); ++p)
      forces[slot(kPoints[k].ids[p])] += kPoints[k].weights[p] * on_points[k];
  return forces;
}

std::vector<Vec3> expected(const Cloud& cloud, PullKind kind, int springs, bool friction_alone) {
  std::vector<Vec3> on_points;
  for (std::size_t k = 0; k < kPoints.size(); ++k) {
    const double size = 1 + static_cast<double>(k);
    Vec3& force = on_points.emplace_back(Vec3::Zero());
    if (!kind.springs && !friction_alone) force -= size * cloud.of_point(k, false);
    if (kind.damps) force -= kDamping * size * cloud.of_point(k, true);
  }
  for (int i = 0; i < springs && !friction_alone; ++i) {
    const Vec3 d = cloud.of_point(slot(i), false) - cloud.of_point(slot(i) + 1, false);
    const Vec3 force = -10.0 * (i + 1) * (1 - 0.3 / d.norm()) * d;
    on_points[slot(i)] += force;
    on_points[slot(i) + 1] -= force;
  }
  return shared_out(on_points);
}

// `add` in tiles that end anywhere, onto a force of 1 N that is there.
template <class Add>
void require_forces(const std::vector<Vec3>& right, Add add) {
  for (const std::vector<int>& ends :
       {std::vector<int>{kParticles}, {1, 3, 4, kParticles}, {2, 7, 8, 8, kParticles}}) {
    std::vector<double> sums[3];
    for (std::vector<double>& each : sums) each.assign(kParticles, 1);
    int begin = 0;
    for (const int end : ends) {
      add(Tile{begin, end}, ForceSink{sums[0].data(), sums[1].data(), sums[2].data()});
      begin = end;
    }
    for (int i = 0; i < kParticles; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        INFO("particle " << i << ", axis " << axis);
        REQUIRE(sums[axis][slot(i)] == Approx(1 + right[slot(i)][axis]).epsilon(1e-12));
      }
  }
}

}  // namespace

TEST_CASE("a force on points acts on their particles by weights", "[particles]") {
  ThreadPool pool(1);
  for (const PullKind kind :
       {PullKind{}, PullKind{.damps = true}, PullKind{.conservative = true},
        PullKind{.damps = true, .conservative = true}, PullKind{.springs = true},
        PullKind{.springs = true, .conservative = true},
        PullKind{.springs = true, .damps = true, .conservative = true}}) {
    INFO(kind.springs << kind.damps << kind.conservative);
    ParticleView seen;
    const auto force = force_on_nodes(std::make_unique<Pull>(kind, &seen), kPoints);
    const Cloud first(1);
    force->bind(first.view);
    const int springs = kind.springs ? 3 : 0;
    for (const unsigned seed : {1u, 2u}) {  // sums of the state before are gone
      const Cloud cloud(seed);
      force->prepare(cloud.view, pool);
      REQUIRE(seen.n == 4);
      CHECK(seen.t == cloud.view.t);
      double energy = 0;
      for (int k = 0; k < 4; ++k) {
        CHECK((seen.position(k) - cloud.of_point(slot(k), false)).norm() < 1e-15);
        CHECK((seen.velocity(k) - cloud.of_point(slot(k), true)).norm() < 1e-15);
        double mass = 0;
        for (int p = 0; p < kPoints[slot(k)].count; ++p) mass += 1 + kPoints[slot(k)].ids[slot(p)];
        CHECK(seen.mass[k] == mass);
        energy += 0.5 * (1 + k) * cloud.of_point(slot(k), false).squaredNorm();
      }
      require_forces(expected(cloud, kind, springs, false),
                     [&](Tile tile, ForceSink sink) { force->accumulate(cloud.view, tile, sink); });
      CHECK(force->potential(cloud.view, {0, 5}) == Approx(energy).epsilon(1e-12));
      CHECK(force->potential(cloud.view, {5, kParticles}) == 0);
      CHECK(force->potential(cloud.view, {1, kParticles}) == 0);
      if (kind.damps)
        require_forces(expected(cloud, kind, springs, true), [&](Tile tile, ForceSink sink) {
          force->dissipative_part(cloud.view, tile, sink);
        });
    }
    CHECK(force->depends_on_velocity() == kind.damps);
    CHECK(force->has_dissipative_part() == kind.damps);
    CHECK(force->conservative() == (kind.conservative && !kind.damps));
    CHECK(force->breakable() == nullptr);
    CHECK(force->springs() == nullptr);
  }
}

TEST_CASE("springs on points that break pull no more", "[particles]") {
  ThreadPool pool(1);
  constexpr PullKind kKind{.springs = true, .conservative = true, .breaks = true};
  ParticleView seen;
  const auto force = force_on_nodes(std::make_unique<Pull>(kKind, &seen), kPoints);
  const Cloud cloud(3);
  force->bind(cloud.view);
  Breakable* const breakable = force->breakable();
  REQUIRE(breakable);
  CHECK(breakable->ties() == 3);
  // The first particle of each point.
  CHECK(breakable->ends(0) == std::array<int, 2>{7, 0});
  CHECK(breakable->ends(1) == std::array<int, 2>{0, 3});
  CHECK(breakable->ends(2) == std::array<int, 2>{3, 2});
  std::size_t seen_whole = 0, overloaded = 0;
  for (unsigned seed = 3; seed < 9; ++seed) {
    const Cloud other(seed);
    std::vector<int> found, right;
    breakable->find_overloaded(other.view, {}, found);
    for (int k = 0; k < 3; ++k) {
      CHECK(breakable->energy(other.view, k) == Approx(other.of_point(slot(k), false).x()));
      if (other.of_point(slot(k), false).x() > 0) right.push_back(k);
    }
    CHECK(found == right);
    overloaded += right.size();
    seen_whole += 3 - right.size();
  }
  CHECK((overloaded > 2 && seen_whole > 2));
  for (const int left : {3, 2, 1}) {
    const std::vector<int> broken(slot(3 - left), 2);
    breakable->set_broken(broken);
    force->prepare(cloud.view, pool);
    require_forces(expected(cloud, kKind, left, false),
                   [&](Tile tile, ForceSink sink) { force->accumulate(cloud.view, tile, sink); });
  }
}

TEST_CASE("points of particles without velocities have none", "[particles]") {
  ThreadPool pool(1);
  ParticleView seen;
  const auto force = force_on_nodes(std::make_unique<Pull>(PullKind{}, &seen), kPoints);
  Cloud cloud(4);
  force->bind(cloud.view);
  cloud.view.vx = cloud.view.vy = cloud.view.vz = nullptr;
  force->prepare(cloud.view, pool);
  CHECK(seen.vx == nullptr);
  CHECK(seen.vz == nullptr);
  CHECK((seen.position(2) - cloud.of_point(2, false)).norm() < 1e-15);
}

namespace {

// Half the square of the distance of two points, a row each; one row joins a point and itself.
class Distances final : public Constraint {
 public:
  RowPattern pattern() const override {
    RowPattern pattern;
    for (const auto& [a, b] : kPairs) pattern.add({a, b});
    return pattern;
  }
  void evaluate(const ParticleView& view, const Rows& rows) const override {
    for (std::size_t r = 0; r < std::size(kPairs); ++r) {
      const Vec3 d = view.position(kPairs[r][0]) - view.position(kPairs[r][1]);
      rows.phi[r] = 0.5 * d.squaredNorm();
      rows.gradient[2 * r] = d;
      rows.gradient[2 * r + 1] = -d;
      rows.drive[r] = view.t + static_cast<double>(r);
      const Vec3 v = view.velocity(kPairs[r][0]) - view.velocity(kPairs[r][1]);
      rows.bias[r] = v.squaredNorm();
    }
  }
  std::string name(int row) const override { return "pair " + std::to_string(row); }

  static constexpr int kPairs[][2] = {{0, 1}, {1, 2}, {3, 1}, {2, 0}};  // the third shares 2
};

}  // namespace

TEST_CASE("gradients of a constraint on points are those of its equations", "[particles]") {
  const auto constraint = constraint_on_nodes(std::make_unique<Distances>(), kPoints);
  Cloud cloud(5);
  constraint->bind(cloud.view);
  const RowPattern pattern = constraint->pattern();
  const std::size_t rows = std::size(Distances::kPairs);
  REQUIRE(pattern.rows() == static_cast<int>(rows));
  CHECK(pattern.of(0).size() == 5);
  CHECK(pattern.of(1).size() == 7);  // 3 is in both
  CHECK(pattern.of(2).size() == 4);  // 2 is of the other point, too
  struct Values {
    std::vector<double> phi, drive, bias;
    std::vector<Vec3> gradient;
  };
  const auto values = [&] {
    Values out{std::vector<double>(rows), std::vector<double>(rows), std::vector<double>(rows),
               std::vector<Vec3>(pattern.ids.size(), Vec3(9, 9, 9))};
    constraint->evaluate(cloud.view,
                         {out.phi.data(), out.gradient.data(), out.drive.data(), out.bias.data()});
    return out;
  };
  const Values now = values();
  for (std::size_t r = 0; r < rows; ++r) {
    INFO("row " << r);
    const auto a = slot(Distances::kPairs[r][0]), b = slot(Distances::kPairs[r][1]);
    CHECK(now.phi[r] ==
          Approx(0.5 * (cloud.of_point(a, false) - cloud.of_point(b, false)).squaredNorm()));
    CHECK(now.bias[r] == Approx((cloud.of_point(a, true) - cloud.of_point(b, true)).squaredNorm()));
    CHECK(now.drive[r] == cloud.view.t + static_cast<double>(r));
    std::vector<bool> joined(kParticles, false);
    for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
      const int id = pattern.ids[slot(e)];
      CHECK_FALSE(joined[slot(id)]);  // once
      joined[slot(id)] = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double& moved = cloud.numbers[axis][slot(id)];
        const double before = moved;
        double phi[2];
        for (const int side : {0, 1}) {
          moved = before + (side ? 1e-4 : -1e-4);
          phi[side] = values().phi[r];
        }
        moved = before;
        CHECK(now.gradient[slot(e)][axis] == Approx((phi[1] - phi[0]) / 2e-4).margin(1e-9));
      }
    }
    for (int id = 0; id < kParticles; ++id) {  // and no other particle moves the row
      double& moved = cloud.numbers[1][slot(id)];
      const double before = moved;
      moved += 0.5;
      CHECK((values().phi[r] == now.phi[r]) == !joined[slot(id)]);
      moved = before;
    }
  }
  CHECK(constraint->name(2) == "pair 2 of its points");
  CHECK(constraint->breakable() == nullptr);
}

namespace {

// The rows of Distances that are whole, as ties that break; and the place of point 1 as memory.
class Ropes final : public Constraint, public Breakable {
 public:
  RowPattern pattern() const override {
    RowPattern pattern;
    for (std::size_t r = 0; r < std::size(Distances::kPairs); ++r)
      if (std::ranges::count(broken_, static_cast<int>(r)) == 0)
        pattern.add({Distances::kPairs[r][0], Distances::kPairs[r][1]});
    return pattern;
  }
  void evaluate(const ParticleView&, const Rows&) const override {}
  bool moves() const override { return true; }
  int internal_size() const override { return 2; }
  void start(std::span<double> memory) const override { memory[1] = 7; }
  void follow(const ParticleView& view, std::span<double> memory) const override {
    memory[0] = view.position(1).y();
  }
  std::string complaint() const override { return "too far"; }
  std::string note() const override { return "a note"; }
  Breakable* breakable() override { return this; }
  int ties() const override { return static_cast<int>(std::size(Distances::kPairs)); }
  std::array<int, 2> ends(int tie) const override {
    return {Distances::kPairs[tie][0], Distances::kPairs[tie][1]};
  }
  double energy(const ParticleView& view, int tie) const override {
    return view.position(Distances::kPairs[tie][0]).x();
  }
  void find_overloaded(const ParticleView& view, std::span<const double> multipliers,
                       std::vector<int>& ties) const override {
    for (std::size_t r = 0; r < multipliers.size(); ++r)
      if (multipliers[r] > view.position(Distances::kPairs[r][0]).x())
        ties.push_back(static_cast<int>(r));
  }
  void set_broken(std::span<const int> ties) override { broken_.assign(ties.begin(), ties.end()); }

 private:
  std::vector<int> broken_;
};

}  // namespace

TEST_CASE("a constraint on points remembers and breaks by the places of its points",
          "[particles]") {
  const auto constraint = constraint_on_nodes(std::make_unique<Ropes>(), kPoints);
  const Cloud first(1);
  constraint->bind(first.view);
  CHECK((constraint->moves() && constraint->internal_size() == 2));
  CHECK((constraint->complaint() == "too far" && constraint->note() == "a note"));
  Breakable* const ropes = constraint->breakable();
  REQUIRE(ropes);
  CHECK(ropes->ties() == 4);
  CHECK(ropes->ends(0) == std::array<int, 2>{7, 0});
  CHECK(ropes->ends(1) == std::array<int, 2>{0, 3});
  CHECK(ropes->ends(2) == std::array<int, 2>{2, 0});
  std::size_t whole = 0, torn = 0;
  for (unsigned seed = 2; seed < 9; ++seed) {
    const Cloud cloud(seed);
    double memory[2] = {};
    constraint->start(memory);
    CHECK((memory[0] == 0 && memory[1] == 7));
    constraint->follow(cloud.view, memory);
    CHECK(memory[0] == Approx(cloud.of_point(1, false).y()));
    CHECK(memory[1] == 7);
    const double multipliers[] = {0.1, -0.2, 0.3, 0};
    std::vector<int> found{9}, right{9};  // to which they are appended
    ropes->find_overloaded(cloud.view, multipliers, found);
    for (std::size_t r = 0; r < 4; ++r) {
      const double place = cloud.of_point(slot(Distances::kPairs[r][0]), false).x();
      CHECK(ropes->energy(cloud.view, static_cast<int>(r)) == Approx(place));
      if (multipliers[r] > place) right.push_back(static_cast<int>(r));
    }
    CHECK(found == right);
    torn += right.size() - 1;
    whole += 5 - right.size();
  }
  CHECK((torn > 5 && whole > 5));
  // Equations of what is broken are left out, and come back.
  const RowPattern all = constraint->pattern();
  const int broken[] = {0, 2};
  ropes->set_broken(broken);
  const RowPattern left = constraint->pattern();
  REQUIRE(left.rows() == 2);
  CHECK(std::ranges::equal(left.of(0), all.of(1)));
  CHECK(std::ranges::equal(left.of(1), all.of(3)));
  ropes->set_broken({});
  CHECK(constraint->pattern().ids == all.ids);
  CHECK(constraint->pattern().begin == all.begin);
}
