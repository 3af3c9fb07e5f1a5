// Cells of a body between particles, with four faces: of 4 particles, with linear shape functions,
// or of 10, with quadratic ones: the corners 0 1 2 3, then one on each edge 01 12 02 03 13 23.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/math/vec3.h"

namespace sim {

using PlaceOf = std::function<Vec3(int id)>;  // m, where the particles rest

// An integration point of a cell: one in a cell of 4, four in one of 10.
struct CellPoint {
  double weight = 0;              // m^3; < 0 where the cell is inside out
  std::array<Vec3, 10> gradient;  // 1/m, of each shape function with respect to the place at rest
};
constexpr int cell_points(int nodes) { return nodes == 4 ? 1 : 4; }
// Gradients are not finite if the weight is 0.
CellPoint cell_point(std::span<const int> ids, const PlaceOf& at, int point);

// The volume, m^3, never negative.
double cell_volume(std::span<const int> ids, const PlaceOf& at);

// The share of a cell's mass that a node has. Linear: 1/4. Quadratic: the diagonal of the mass
// matrix, scaled to the whole (Hinton, Rock & Zienkiewicz (1976), Earthq. Eng. Struct. Dyn. 4,
// 245-249): 1/36 at a corner, 4/27 on an edge.
constexpr double lumped_share(int nodes, int node) {
  return nodes == 4 ? 0.25 : node < 4 ? 1.0 / 36 : 4.0 / 27;
}

// Six cells for each step of a grid of particles (i * size[1] + j) * size[2] + k, along the paths
// from its lowest corner to its highest (Kuhn (1960), IBM J. Res. Dev. 4, 518-524). Neighbours
// conform, and so do the triangles of grid_triangles(). Order 2: a cell is two steps of the grid in
// each direction, the sizes are odd, and every particle is a node. Four or ten ids each.
std::vector<int> grid_cells(const std::array<int, 3>& size, int order);

// The triangles of these cells that no other shares, seen counter-clockwise from outside.
std::vector<TriangleMesh::Triangle> skin_of(std::span<const int> ids, int nodes, const PlaceOf& at);

}  // namespace sim
