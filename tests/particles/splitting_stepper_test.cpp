// Steps of splitting methods: how often they evaluate forces.
#include <algorithm>
#include <catch2/catch.hpp>

#include "core/base/thread_pool.h"
#include "core/particles/particle_system.h"

using namespace sim;

namespace {

struct Kind {
  bool conservative = true, by_velocity = false;
};

// A spring of 3 N/m to the origin, that counts its evaluations.
class CountedSpring final : public Force {
 public:
  CountedSpring(const Kind& kind, int& count) : kind_(kind), count_(&count) {}
  void prepare(const ParticleView&, ThreadPool&) override { ++*count_; }
  void accumulate(const ParticleView& view, Tile tile, ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) sink.add(i, -3 * view.position(i));
  }
  bool conservative() const override { return kind_.conservative; }
  bool depends_on_velocity() const override { return kind_.by_velocity; }

 private:
  Kind kind_;
  int* count_;
};

SplitPlan verlet() { return {.drift = {0, 1, 0}, .kick = {0.5, 0.5}, .order = 2}; }

// The evaluations of ten steps of velocity Verlet, and the state after them.
std::pair<int, Array> ten_steps(const Kind& kind, bool moved = false) {
  const Layout layout(16);
  Array x(layout.size()), next(layout.size());
  const auto [qx, qy, qz] = layout.axes(x.data());
  for (int i = 0; i < 16; ++i) qx[i] = 1 + 0.1 * i;
  ThreadPool pool(1);
  int count = 0;
  std::vector<std::unique_ptr<Force>> forces;
  forces.push_back(std::make_unique<CountedSpring>(kind, count));
  ParticleSystem system(std::vector<double>(16, 1.0), {}, std::move(forces), x.data(), pool);
  const std::unique_ptr<Stepper> stepper = system.split_stepper(verlet());
  for (int step = 0; step < 10; ++step) {
    REQUIRE(stepper->step(0.1 * step, 0.1, 1, x.data(), next.data()));
    std::swap(x, next);
    if (!moved || step != 4) continue;
    layout.axes(x.data())[0][3] += 1;
    stepper->restart();
  }
  return {count, std::move(x)};
}

bool same(const Array& a, const Array& b) {
  return std::equal(a.data(), a.data() + a.size(), b.data(), b.data() + b.size());
}

}  // namespace

TEST_CASE("velocity Verlet evaluates forces that follow from positions once a step") {
  const auto [once, x] = ten_steps({});
  const auto [twice, other] = ten_steps({.conservative = false});
  CHECK(once == 11);
  CHECK(twice == 20);  // such a force may depend on the time, which is rounded another way
  CHECK(same(x, other));
  CHECK(ten_steps({.by_velocity = true}).first == 40);  // midpoints of kicks
}

TEST_CASE("after a change by hand velocity Verlet evaluates forces anew") {
  const auto [count, x] = ten_steps({}, true);
  const auto [plain, other] = ten_steps({.conservative = false}, true);
  CHECK(count == 12);
  CHECK(same(x, other));
  CHECK_FALSE(same(x, ten_steps({}).second));
}
