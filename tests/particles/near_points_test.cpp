// Springs that may be pressed to a point, against a plain loop over the list they were made of.
#include "core/particles/springs/near_points.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

using namespace sim;

namespace {

using Tie = std::tuple<int, int, double, double>;  // a < b, k, rest

// Runs of one kind, runs whose springs differ, and springs that fit no run.
std::vector<Tie> ties_of(int n, std::mt19937& random) {
  std::vector<Tie> ties;
  for (int i = 0; i + 1 < n; ++i)
    if (i % 5 != 3) ties.emplace_back(i, i + 1, 100, 1);
  for (int i = 0; i + 3 < n; ++i) ties.emplace_back(i, i + 3, 10.0 + i, 0.5 + 0.01 * (i % 100));
  for (int i = 0; i < n / 3; ++i) {
    const int a = static_cast<int>(random() % static_cast<unsigned>(n));
    const int b = static_cast<int>(random() % static_cast<unsigned>(n));
    if (a != b) ties.emplace_back(std::min(a, b), std::max(a, b), 1000.0 + i, 0.8);
  }
  return ties;
}

// The least length on straight lines within so many s.
double least_length(const ParticleView& p, const Tie& tie, double ahead) {
  const auto [a, b, k, rest] = tie;
  const Vec3 d = p.position(a) - p.position(b), v = p.velocity(a) - p.velocity(b);
  const double s = v.squaredNorm() > 0 ? std::clamp(-d.dot(v) / v.squaredNorm(), 0.0, ahead) : 0;
  return (d + s * v).norm();
}

}  // namespace

TEST_CASE("springs that may come near a point are all seen, once, with their numbers") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<int> sizes;
  for (int n = 2; n <= 40; ++n) sizes.push_back(n);
  for (const int block : {256, 512})
    for (int n = block - 2; n <= block + 5; ++n) sizes.push_back(n);
  std::size_t seen = 0, near = 0, all = 0, left_out = 0;
  for (const int n : sizes) {
    const std::vector<Tie> ties = ties_of(n, random);
    const Springs springs(n, [&](const Springs::Visit& visit) {
      for (const auto& [a, b, k, rest] : ties) visit(a, b, k, rest);
    });
    std::vector<double> state[6];
    for (int block = 0; block < 6; ++block)
      for (int i = 0; i < n; ++i) state[block].push_back((block < 3 ? 0.4 : 1) * uniform(random));
    ParticleView p;
    p.n = n;
    p.x = state[0].data(), p.y = state[1].data(), p.z = state[2].data();
    p.vx = state[3].data(), p.vy = state[4].data(), p.vz = state[5].data();
    for (const double ahead : {0.0, 0.1, 0.5})
      for (const double share : {0.0, 0.1, 0.6}) {
        INFO(n << " particles, " << ahead << " s, " << share);
        std::vector<Tie> found, expected;
        visit_near_points(springs, p, ahead, share, [&](int a, int b, double k, double rest) {
          found.emplace_back(std::min(a, b), std::max(a, b), k, rest);
        });
        for (const Tie& tie : ties) {
          const auto [a, b, k, rest] = tie;
          const double length = (p.position(a) - p.position(b)).norm(),
                       way = ahead * (p.velocity(a) - p.velocity(b)).norm();
          // (x + y)^2 <= 2 (x^2 + y^2): no spring that is near is left out.
          if (length * length <= 2 * (share * share * rest * rest + way * way))
            expected.push_back(tie);
          if (least_length(p, tie, ahead) >= share * rest) continue;
          ++near;
          left_out += expected.empty() || expected.back() != tie;
        }
        std::ranges::sort(found);
        std::ranges::sort(expected);
        CHECK(found == expected);
        seen += found.size();
        all += ties.size();
      }
  }
  CHECK(left_out == 0);
  CHECK(near > 100);
  CHECK(seen > near);
  CHECK(seen < all * 3 / 4);
}
