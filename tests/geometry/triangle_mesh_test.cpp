#include "core/geometry/triangle_mesh.h"

#include <catch2/catch.hpp>

#include <set>

#include "core/base/error.h"

using namespace sim;

namespace {

TriangleMesh of_grid(const std::array<int, 3>& size, bool mirrored = false) {
  return TriangleMesh(size[0] * size[1] * size[2], grid_triangles(size, mirrored));
}

std::array<int, 3> place(const std::array<int, 3>& size, int id) {
  return {id / size[2] / size[1], id / size[2] % size[1], id % size[2]};
}

Vec3 point(const std::array<int, 3>& size, int id) {
  const auto [i, j, k] = place(size, id);
  return Vec3(i, j, k);
}

Vec3 area(const std::array<int, 3>& size, const TriangleMesh::Triangle& t) {
  const Vec3 a = point(size, t[0]);
  return (point(size, t[1]) - a).cross(point(size, t[2]) - a) / 2;
}

}  // namespace

TEST_CASE("the boundary of a block of particles is closed and has its outside outside") {
  for (const std::array<int, 3>& size :
       {std::array<int, 3>{2, 2, 2}, {3, 2, 2}, {2, 5, 3}, {4, 4, 4}}) {
    const TriangleMesh surface = of_grid(size);
    std::set<int> used;
    Vec3 sum = Vec3::Zero();
    double volume = 0;
    for (const TriangleMesh::Triangle& t : surface.triangles()) {
      used.insert(t.begin(), t.end());
      sum += area(size, t);
      volume += point(size, t[0]).dot(area(size, t)) / 3;
    }
    // Euler: vertices - edges + faces = 2; each edge has two triangles of three edges.
    const auto faces = static_cast<int>(surface.triangles().size());
    CHECK(surface.closed());
    CHECK(static_cast<int>(used.size()) - static_cast<int>(surface.edges().size()) + faces == 2);
    CHECK(2 * static_cast<int>(surface.edges().size()) == 3 * faces);
    CHECK(sum == Vec3::Zero());
    CHECK(volume == Approx((size[0] - 1) * (size[1] - 1) * (size[2] - 1)).epsilon(1e-14));
    // No particle inside.
    for (const int id : used) {
      const auto at = place(size, id);
      CHECK(
          (at[0] % (size[0] - 1) == 0 || at[1] % (size[1] - 1) == 0 || at[2] % (size[2] - 1) == 0));
    }
  }
}

TEST_CASE("a sheet of particles has two triangles a cell and one boundary around it") {
  for (const std::array<int, 3>& size :
       {std::array<int, 3>{3, 4, 1}, {3, 1, 4}, {1, 3, 4}, {2, 2, 1}}) {
    const TriangleMesh surface = of_grid(size), mirrored = of_grid(size, true);
    std::array<int, 3> sorted = size;
    std::sort(sorted.begin(), sorted.end());
    const int u = sorted[1], v = sorted[2];
    CHECK(static_cast<int>(surface.triangles().size()) == 2 * (u - 1) * (v - 1));
    CHECK(static_cast<int>(surface.boundary().size()) == 2 * (u - 1) + 2 * (v - 1));
    CHECK_FALSE(surface.closed());
    for (std::size_t i = 0; i < surface.triangles().size(); ++i) {
      // Outside is where the direction of size 1 would grow; of a mirrored one the other way.
      const Vec3 a = area(size, surface.triangles()[i]);
      for (int axis = 0; axis < 3; ++axis)
        CHECK(a[axis] == (size[static_cast<std::size_t>(axis)] == 1 ? 0.5 : 0));
      CHECK(area(size, mirrored.triangles()[i]) == -a);
    }
  }
}

TEST_CASE("edges know their triangles, and particles their corners") {
  //  3 - 2
  //  | / |      two triangles, the lower one first
  //  0 - 1
  const TriangleMesh square(5, {{0, 1, 2}, {0, 2, 3}});
  REQUIRE(square.edges().size() == 5);
  const TriangleMesh::Edge& diagonal = square.edges()[1];
  CHECK((diagonal.ends == std::array<int, 2>{2, 0}));  // as the first triangle has it
  CHECK((diagonal.triangles == std::array<int, 2>{0, 1}));
  CHECK((diagonal.opposite == std::array<int, 2>{1, 3}));
  CHECK_FALSE(diagonal.boundary());
  CHECK(std::vector<int>(square.boundary().begin(), square.boundary().end()) ==
        std::vector<int>{0, 2, 3, 4});
  CHECK((square.edges()[2].ends == std::array<int, 2>{3, 0}));
  CHECK((square.edges()[2].triangles == std::array<int, 2>{1, -1}));
  CHECK((square.edges()[2].opposite == std::array<int, 2>{2, -1}));

  const auto corners = [&](int i) {
    return std::vector<int>(square.corners(i).begin(), square.corners(i).end());
  };
  CHECK(corners(0) == std::vector<int>{0, 3});
  CHECK(corners(2) == std::vector<int>{2, 4});
  CHECK(corners(3) == std::vector<int>{5});
  CHECK(corners(4).empty());
}

TEST_CASE("what is no surface is refused with its triangles") {
  const struct {
    std::vector<TriangleMesh::Triangle> triangles;
    const char* what;
    const char* why;
  } cases[] = {
      {{}, "bad surface", "no triangle"},
      {{{0, 1, 5}}, "bad triangle 1", "no particle 5"},
      {{{0, 1, 2}, {0, -1, 2}}, "bad triangle 2", "no particle -1"},
      {{{0, 1, 1}}, "bad triangle 1", "{0, 1, 1} has a particle twice"},
      {{{1, 0, 1}}, "bad triangle 1", "twice"},
      {{{0, 1, 2}, {0, 1, 3}}, "bad edge 0-1", "triangles 1 and 2 have it in the same direction"},
      {{{0, 1, 2}, {0, 1, 2}}, "bad edge 0-1", "the same direction"},
      {{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}, "bad edge 0-1", "3 triangles have it"},
      // A Moebius strip of five triangles: no order of its neighbours fits.
      {{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 0}, {4, 0, 1}}, "bad edge", "same direction"},
  };
  for (const auto& [triangles, what, why] : cases) {
    INFO(why);
    try {
      TriangleMesh(5, triangles);
      FAIL("taken");
    } catch (const Error& error) {
      CHECK(error.kind() == ErrorKind::kScene);
      CHECK_THAT(error.text().what, Catch::StartsWith(what));
      CHECK_THAT(error.text().why, Catch::Contains(why));
      CHECK_FALSE(error.text().remedy.empty());
    }
  }
}

TEST_CASE("triangles without an area are found at any size") {
  const TriangleMesh surface(4, {{0, 1, 2}, {0, 2, 3}});
  for (const double size : {1e-200, 1.0, 1e200}) {
    std::vector<Vec3> x{{0, 0, 0}, {size, 0, 0}, {size, size, 0}, {0, size, 0}};
    const auto at = [&](int i) { return x[static_cast<std::size_t>(i)]; };
    CHECK(flat_triangle(surface, at) == -1);
    x[3] = {size / 3, size / 3, 0};  // on the line from 0 to 2
    CHECK(flat_triangle(surface, at) == 1);
    x[1] = x[2];
    CHECK(flat_triangle(surface, at) == 0);
  }
}
