// A triangle mesh between particles, and its adjacency.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "core/geometry/incidence.h"
#include "core/math/vec3.h"

namespace sim {

class TriangleMesh {
 public:
  using Triangle = std::array<int, 3>;  // counter-clockwise as seen from outside

  // An edge has one triangle, which has the ends in this order, or two: then the second has them in
  // the other order. Ascending by the lower end.
  struct Edge {
    std::array<int, 2> ends, triangles,
        opposite;  // the second triangle and its third corner: or -1
    bool boundary() const { return triangles[1] < 0; }
  };

  // A mesh of n particles. Throws Error{kScene} unless every triangle has three different particles
  // in [0, n), no edge has more than two triangles, and neighbours have the same side outside.
  TriangleMesh(int n, std::vector<Triangle> triangles);

  int particles() const { return particles_; }
  std::span<const Triangle> triangles() const { return triangles_; }
  std::span<const Edge> edges() const { return edges_; }
  std::span<const int> boundary() const { return boundary_; }  // edges with one triangle, ascending
  bool closed() const { return boundary_.empty(); }

  // The corners of triangles at particle i, ascending: 3 * triangle + corner.
  std::span<const int> corners(int i) const { return corners_.at(i); }
  const Incidence& corners() const { return corners_; }
  // All of them: three ids a triangle.
  std::span<const int> ids() const { return {triangles_.front().data(), 3 * triangles_.size()}; }

 private:
  void check_triangles() const;
  void find_edges();

  int particles_;
  std::vector<Triangle> triangles_;
  std::vector<Edge> edges_;
  std::vector<int> boundary_;
  Incidence corners_;
};

// The first triangle without an area at these positions; -1 if there is none.
int flat_triangle(const TriangleMesh& surface, const std::function<Vec3(int)>& position);

// Two triangles for each cell of a grid of particles (i * size[1] + j) * size[2] + k: of a sheet,
// which has a size of 1 in one direction, or of the boundary of a block. If i, j and k run along a
// right-handed system, the outside of a sheet in (i, j) is in the direction of k; a left-handed
// system has to be mirrored.
std::vector<TriangleMesh::Triangle> grid_triangles(const std::array<int, 3>& size, bool mirrored);

}  // namespace sim
