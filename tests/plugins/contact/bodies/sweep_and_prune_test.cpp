// The broad phase of bodies against all pairs.
#include <catch2/catch.hpp>

#include <random>
#include <set>

#include "core/base/slot.h"
#include "plugins/contact/bodies/sweep_and_prune.h"

namespace sim {
namespace {

using Pair = SweepAndPrune::Pair;

// Balls of all sizes in a box that is longest along one axis; the number 3 takes no part.
std::vector<Ball> scattered(int count, std::size_t axis, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<Ball> balls(static_cast<std::size_t>(count));
  for (Ball& ball : balls) {
    ball.center = {part(random), part(random), part(random)};
    ball.center[axis] *= 5;
    ball.radius = 0.02 + 0.2 * part(random) * part(random);
  }
  return balls;
}

SweepAndPrune taking_part(int count) {
  SweepAndPrune sweep;
  for (int i = 0; i < count; ++i)
    if (i != 3) sweep.take(i);
  return sweep;
}

bool joined(int i, int j) { return (i + j) % 11 == 0; }

std::set<Pair> all_pairs(const std::vector<Ball>& balls) {
  std::set<Pair> pairs;
  const int n = static_cast<int>(balls.size());
  for (int i = 0; i < n; ++i)
    for (int j = i + 1; j < n; ++j)
      if (i != 3 && j != 3 && !joined(i, j) &&
          (balls[slot(i)].center - balls[slot(j)].center).norm() <=
              balls[slot(i)].radius + balls[slot(j)].radius)
        pairs.insert({i, j});
  return pairs;
}

std::set<Pair> meeting(const SweepAndPrune& sweep, const std::vector<Ball>& balls) {
  std::set<Pair> pairs;
  for (const auto& [i, j] : sweep.pairs())
    if (SweepAndPrune::meet(balls[slot(i)], balls[slot(j)])) pairs.insert({i, j});
  return pairs;
}

TEST_CASE("the broad phase finds the pairs of balls that meet, as they move", "[rigid]") {
  for (const std::size_t axis : {0, 1, 2})
    for (const int count : {0, 1, 2, 10, 200}) {
      INFO(count << " along " << axis);
      std::vector<Ball> balls = scattered(count, axis, 7);
      SweepAndPrune sweep = taking_part(count);
      std::mt19937 random(5);
      std::normal_distribution<double> move;
      std::size_t found = 0;
      for (int step = 0; step < 60; ++step) {
        sweep.update(balls, joined);
        CHECK(std::ranges::is_sorted(sweep.pairs()));
        CHECK(meeting(sweep, balls) == all_pairs(balls));
        found += sweep.pairs().size();
        for (int i = 0; i < count; ++i) {
          std::vector<int> of;
          for (const auto& [first, second] : sweep.pairs_of(i)) of.push_back(second);
          for (const auto& [first, second] : sweep.pairs())
            if (first == i) CHECK(std::ranges::find(of, second) != of.end());
        }
        const double far = step % 20 == 19 ? 0.3 : 2e-4;  // most steps keep the pairs
        for (Ball& ball : balls) {
          ball.center += far * Vec3(move(random), move(random), move(random));
          ball.radius *= step % 7 == 6 ? 1.2 : 1;
        }
      }
      CHECK((count < 200 || found > 6000));
    }
}

TEST_CASE("pairs of balls are kept until one leaves its room", "[rigid]") {
  std::vector<Ball> balls = {{{0, 0, 0}, 1}, {{2.15, 0, 0}, 1}, {{0, 9, 0}, 1}};
  SweepAndPrune sweep;
  for (int i = 0; i < 3; ++i) sweep.take(i);
  int asked = 0;
  const auto update = [&] {
    asked = 0;
    sweep.update(balls, [&](int, int) { return ++asked < 0; });
    return asked > 0;
  };
  CHECK(update());  // rooms overlap, balls do not
  CHECK(sweep.pairs().size() == 1);
  CHECK_FALSE(SweepAndPrune::meet(balls[0], balls[1]));
  balls[1].center = {1.9, 0, 0};
  CHECK(update());
  CHECK(SweepAndPrune::meet(balls[0], balls[1]));
  balls[2].center = {0, 9.05, 0};
  balls[1].center = {1.9, 0.05, 0};
  CHECK_FALSE(update());
  balls[2].center = {0, 2, 0};  // it comes near
  CHECK(update());
  CHECK(sweep.pairs().size() == 2);
  balls[2].radius = 1.2;  // it grows out of its room
  CHECK(update());
  balls[2].radius = 0.5;  // it has much more than it needs
  CHECK(update());
  CHECK(sweep.pairs().size() == 1);
}

TEST_CASE("balls near a point are found, whatever room they have", "[rigid]") {
  std::vector<Ball> balls = scattered(200, 1, 3);
  SweepAndPrune sweep = taking_part(200);
  sweep.update(balls, joined);
  for (Ball& ball : balls) ball.center += Vec3(1e-3, -1e-3, 5e-4);
  sweep.update(balls, joined);
  for (const Ball& of : scattered(50, 1, 11)) {
    std::set<int> near;
    sweep.each_near(of.center, of.radius, [&](int ball) { near.insert(ball); });
    for (int i = 0; i < 200; ++i)
      if (i != 3 && SweepAndPrune::meet(of, balls[slot(i)])) CHECK(near.count(i) == 1);
    CHECK(near.size() < 150);
  }
}

TEST_CASE("balls that have run away do no harm", "[rigid]") {
  std::vector<Ball> balls = scattered(100, 0, 3);
  const double inf = HUGE_VAL;
  for (std::size_t k = 0; k < 60; k += 3) balls[k].center = {k % 2 ? inf : -inf, NAN, 0};
  for (std::size_t k = 1; k < 60; k += 9) balls[k].radius = k % 2 ? inf : NAN;
  SweepAndPrune sweep = taking_part(100);
  sweep.update(balls, joined);
  CHECK(std::ranges::is_sorted(sweep.pairs()));
}

}  // namespace
}  // namespace sim
