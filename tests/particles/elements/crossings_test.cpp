// Crossings of surfaces against a count over all pairs in whole numbers, which are exact.
#include "core/particles/elements/mesh_intersections.h"

#include <catch2/catch.hpp>
#include <random>

namespace {

using Whole = std::array<std::int64_t, 3>;

std::int64_t volume(const Whole& a, const Whole& b, const Whole& c, const Whole& d) {
  std::int64_t u[3], v[3], w[3];
  for (std::size_t k = 0; k < 3; ++k) u[k] = b[k] - a[k], v[k] = c[k] - a[k], w[k] = d[k] - a[k];
  return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
         u[2] * (v[0] * w[1] - v[1] * w[0]);
}

bool crosses(const Whole& p, const Whole& q, const Whole& a, const Whole& b, const Whole& c) {
  const auto sign = [](std::int64_t value) { return (value > 0) - (value < 0); };
  if (sign(volume(a, b, c, p)) * sign(volume(a, b, c, q)) >= 0) return false;
  const int s = sign(volume(p, q, a, b)), t = sign(volume(p, q, b, c)),
            r = sign(volume(p, q, c, a));
  return s != 0 && s == t && t == r;
}

struct Sheet {
  explicit Sheet(int n)
      : mesh(std::make_shared<const sim::TriangleMesh>(n * n,
                                                       sim::grid_triangles({n, n, 1}, false))),
        places(static_cast<std::size_t>(n * n)) {}

  std::int64_t by_all_pairs() const {
    std::int64_t count = 0;
    for (const auto& edge : mesh->edges())
      for (const auto& t : mesh->triangles()) {
        const auto [i, j] = edge.ends;
        if (std::ranges::count(t, i) + std::ranges::count(t, j) > 0) continue;
        const auto at = [&](int id) { return places[static_cast<std::size_t>(id)]; };
        count += crosses(at(i), at(j), at(t[0]), at(t[1]), at(t[2]));
      }
    return count;
  }
  std::int64_t counted(double scale) const {
    std::vector<double> q[3];
    for (const Whole& place : places)
      for (std::size_t axis = 0; axis < 3; ++axis)
        q[axis].push_back(scale * static_cast<double>(place[axis]));
    sim::ParticleView view;
    view.n = static_cast<int>(places.size());
    view.x = q[0].data(), view.y = q[1].data(), view.z = q[2].data();
    const std::shared_ptr<const sim::TriangleMesh> surfaces[] = {mesh};
    return sim::MeshIntersections(surfaces).count(view);
  }

  std::shared_ptr<const sim::TriangleMesh> mesh;
  std::vector<Whole> places;
};

}  // namespace

TEST_CASE("a flat sheet does not cross itself, a crumpled one as often as all pairs say") {
  std::mt19937 random(3);
  for (const int n : {3, 6, 9, 12}) {
    Sheet sheet(n);
    for (int i = 0; i < n * n; ++i)
      sheet.places[static_cast<std::size_t>(i)] = {1000 * (i / n), 0, 1000 * (i % n)};
    CHECK(sheet.counted(1e-3) == 0);
    std::int64_t most = 0;
    for (const int reach : {600, 1500, 4000}) {
      std::uniform_int_distribution<std::int64_t> any(-reach, reach);
      for (Whole& place : sheet.places)
        for (auto& coordinate : place) coordinate += any(random);
      CHECK(sheet.counted(0x1p-10) == sheet.by_all_pairs());
      most = std::max(most, sheet.by_all_pairs());
    }
    if (n > 3) CHECK(most > 0);
  }
}

TEST_CASE("a sheet that is folded through itself is seen") {
  Sheet sheet(5);
  for (int i = 0; i < 25; ++i)
    sheet.places[static_cast<std::size_t>(i)] = {i / 5 < 3 ? 100 * (i / 5) : 100 * (5 - i / 5) - 30,
                                                 i / 5 < 3    ? 20
                                                 : i / 5 == 3 ? -30
                                                              : 60,
                                                 100 * (i % 5) + 7 * (i / 5)};
  CHECK(sheet.counted(1) == sheet.by_all_pairs());
  CHECK(sheet.counted(1) > 0);
}
