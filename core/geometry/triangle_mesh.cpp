#include "core/geometry/triangle_mesh.h"

#include <algorithm>
#include <string>

#include "core/base/error.h"

namespace sim {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& why,
                         const std::string& remedy) {
  throw Error(ErrorKind::kScene, {what, "", why, remedy});
}

// The number of a triangle in the scene's lists, which count from 1.
std::string number_of(int triangle) { return std::to_string(triangle + 1); }

std::string shown(const TriangleMesh::Triangle& t) {
  return "{" + std::to_string(t[0]) + ", " + std::to_string(t[1]) + ", " + std::to_string(t[2]) +
         "}";
}

// One side of a triangle, stored at the lower of its ends.
struct Side {
  int high, triangle, opposite;
  bool forward;  // runs from the lower end to the higher one
};

// Collects the sides from `low` to higher particles, sorted by the higher end, then by triangle.
void sides_at(const TriangleMesh& surface, int low, std::vector<Side>& sides) {
  sides.clear();
  for (const int place : surface.corners(low)) {
    const int triangle = place / 3;
    const TriangleMesh::Triangle& t = surface.triangles()[static_cast<std::size_t>(triangle)];
    const auto corner = [&](int turn) { return t[static_cast<std::size_t>((place + turn) % 3)]; };
    const int next = corner(1), last = corner(2);
    if (next > low) sides.push_back({next, triangle, last, true});
    if (last > low) sides.push_back({last, triangle, next, false});
  }
  std::ranges::sort(sides, [](const Side& a, const Side& b) {
    return a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
  });
}

}  // namespace

TriangleMesh::TriangleMesh(int n, std::vector<Triangle> triangles)
    : particles_(n), triangles_(std::move(triangles)) {
  if (triangles_.empty()) refuse("bad surface", "it has no triangle", "list some");
  check_triangles();
  corners_ = Incidence(n, ids());
  find_edges();
}

void TriangleMesh::check_triangles() const {
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const std::string what = "bad triangle " + number_of(static_cast<int>(i)) + " of a surface";
    for (const int id : t)
      if (id < 0 || id >= particles_)
        refuse(what, "there is no particle " + std::to_string(id),
               "the ids of the scene are 0 to " + std::to_string(particles_ - 1));
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
      refuse(what, shown(t) + " has a particle twice", "name three different ones");
  }
}

void TriangleMesh::find_edges() {
  std::vector<Side> sides;
  for (int low = corners_.begin(); low < corners_.end(); ++low) {
    sides_at(*this, low, sides);
    for (std::size_t i = 0; i < sides.size();) {
      const Side& first = sides[i];
      std::size_t count = 1;
      while (i + count < sides.size() && sides[i + count].high == first.high) ++count;
      const std::string edge =
          "bad edge " + std::to_string(low) + "-" + std::to_string(first.high) + " of a surface";
      const auto named = [&](std::size_t other) {
        return "triangles " + number_of(first.triangle) + " and " +
               number_of(sides[i + other].triangle);
      };
      if (count > 2)
        refuse(edge, std::to_string(count) + " triangles have it, among them " + named(1),
               "an edge has one or two; make two surfaces of it");
      if (count == 2 && first.forward == sides[i + 1].forward)
        refuse(edge, named(1) + " have it in the same direction, so that their outsides differ",
               "write the particles of one of them in the other order");

      Edge found{{low, first.high}, {first.triangle, -1}, {first.opposite, -1}};
      if (!first.forward) std::swap(found.ends[0], found.ends[1]);
      if (count == 2) {
        found.triangles[1] = sides[i + 1].triangle;
        found.opposite[1] = sides[i + 1].opposite;
      } else {
        boundary_.push_back(static_cast<int>(edges_.size()));
      }
      edges_.push_back(found);
      i += count;
    }
  }
}

int flat_triangle(const TriangleMesh& surface, const std::function<Vec3(int)>& position) {
  constexpr double kFlat = 1e-12;  // of the square of a side: rounding makes of nothing that much
  const auto largest = [](const Vec3& d) { return d.cwiseAbs().maxCoeff(); };
  for (std::size_t i = 0; i < surface.triangles().size(); ++i) {
    const auto& [a, b, c] = surface.triangles()[i];
    const Vec3 x = position(a), u = position(b) - x, v = position(c) - x;
    const double size = std::max(largest(u), largest(v));
    if (!(size > 0) || !(largest((u / size).cross(v / size)) > kFlat)) return static_cast<int>(i);
  }
  return -1;
}

std::vector<TriangleMesh::Triangle> grid_triangles(const std::array<int, 3>& size, bool mirrored) {
  std::vector<TriangleMesh::Triangle> triangles;
  const auto add = [&](int a, int b, int c, bool turned) {
    if (turned) std::swap(b, c);
    triangles.push_back({a, b, c});
  };
  const bool sheet = std::ranges::min(size) == 1;
  const std::array<int, 3> stride{size[1] * size[2], size[2], 1};

  // The boundary layers across each direction: the last one faces the positive direction, the first
  // one the negative.
  for (std::size_t across = 0; across < 3; ++across) {
    if (sheet && size[across] > 1) continue;
    const std::size_t u = (across + 1) % 3, v = (across + 2) % 3;
    for (const int layer : {0, size[across] - 1}) {
      const bool turned = (layer == 0 && !sheet) != mirrored;
      for (int i = 0; i + 1 < size[u]; ++i)
        for (int j = 0; j + 1 < size[v]; ++j) {
          const int a = layer * stride[across] + i * stride[u] + j * stride[v];
          const int b = a + stride[u], c = b + stride[v], d = a + stride[v];
          add(a, b, c, turned);
          add(a, c, d, turned);
        }
      if (sheet) return triangles;
    }
  }
  return triangles;
}

}  // namespace sim
