#include "core/geometry/cells.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/math/mat3.h"

namespace sim {
namespace {

// The end nodes of the edges, in the order of the nodes on them.
constexpr int kCellEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

// The gradients of the barycentric coordinates L_0 ... L_3 in the coordinates (L_1, L_2, L_3).
constexpr Vec3 kSlopes[4] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

// Quadrature points of degree 2: Hammer, Marlowe & Stroud (1956), Math. Comput. 10, 130-137.
constexpr double kNearPoint = 0.58541019662496845446, kFarPoint = 0.13819660112501051518;

// Gradients of the shape functions: N = L_a (2 L_a - 1) at a corner, 4 L_a L_b on an edge; N = L_a
// in a linear cell.
std::array<Vec3, 10> slopes_at(int nodes, int point) {
  std::array<Vec3, 10> slopes;
  if (nodes == 4) {
    std::copy(kSlopes, kSlopes + 4, slopes.begin());
    return slopes;
  }
  double l[4] = {kFarPoint, kFarPoint, kFarPoint, kFarPoint};
  l[point] = kNearPoint;
  for (std::size_t a = 0; a < 4; ++a) slopes[a] = (4 * l[a] - 1) * kSlopes[a];
  for (std::size_t e = 0; e < 6; ++e) {
    const auto [a, b] = kCellEdges[e];
    slopes[4 + e] = 4 * (l[a] * kSlopes[b] + l[b] * kSlopes[a]);
  }
  return slopes;
}

}  // namespace

// With J = dX/dL at rest: dN/dX = J^-T dN/dL, and the weight det J / 6 divided by the number of
// points.
CellPoint cell_point(std::span<const int> ids, const PlaceOf& at, int point) {
  const auto nodes = static_cast<int>(ids.size());
  const std::array<Vec3, 10> slopes = slopes_at(nodes, point);
  const Vec3 first = at(ids[0]);
  Mat3 jacobian;
  for (std::size_t a = 1; a < ids.size(); ++a) jacobian += outer(at(ids[a]) - first, slopes[a]);
  const auto row = [&](std::size_t i) {
    return Vec3(jacobian(i, 0), jacobian(i, 1), jacobian(i, 2));
  };
  // The rows of the cofactor matrix det J J^-T.
  const Mat3 cofactors(row(1).cross(row(2)), row(2).cross(row(0)), row(0).cross(row(1)));
  const double determinant = row(0).dot(row(1).cross(row(2)));
  CellPoint result;
  result.weight = determinant / (6 * cell_points(nodes));
  for (std::size_t a = 0; a < ids.size(); ++a)
    result.gradient[a] = (cofactors * slopes[a]) / determinant;
  return result;
}

double cell_volume(std::span<const int> ids, const PlaceOf& at) {
  double sum = 0;
  for (int point = 0; point < cell_points(static_cast<int>(ids.size())); ++point)
    sum += cell_point(ids, at, point).weight;
  return std::fabs(sum);
}

std::vector<int> grid_cells(const std::array<int, 3>& size, int order) {
  constexpr int kWays[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  using Corner = std::array<int, 3>;
  const auto id = [&](const Corner& c) { return (c[0] * size[1] + c[1]) * size[2] + c[2]; };
  std::vector<int> ids;
  for (int i = 0; i + order < size[0]; i += order)
    for (int j = 0; j + order < size[1]; j += order)
      for (int k = 0; k + order < size[2]; k += order)
        for (const auto& way : kWays) {
          std::array<Corner, 4> corners;
          corners[0] = {i, j, k};
          for (std::size_t c = 0; c < 3; ++c) {
            corners[c + 1] = corners[c];
            corners[c + 1][static_cast<std::size_t>(way[c])] += order;
          }
          for (const Corner& corner : corners) ids.push_back(id(corner));
          if (order == 1) continue;
          for (const auto& [a, b] : kCellEdges) {
            Corner middle;
            for (std::size_t axis = 0; axis < 3; ++axis)
              middle[axis] = (corners[static_cast<std::size_t>(a)][axis] +
                              corners[static_cast<std::size_t>(b)][axis]) /
                             2;
            ids.push_back(id(middle));
          }
        }
  return ids;
}

std::vector<TriangleMesh::Triangle> skin_of(std::span<const int> ids, int nodes,
                                            const PlaceOf& at) {
  // Each face opposite to a corner, counter-clockwise from outside where the cell is right-handed,
  // with the nodes on its edges ab, bc, ca.
  constexpr int kFaces[4][6] = {
      {1, 2, 3, 5, 9, 8}, {0, 3, 2, 7, 9, 6}, {0, 1, 3, 4, 8, 7}, {0, 2, 1, 6, 5, 4}};
  struct Face {
    std::size_t cell = 0;
    int side = 0, count = 0;
  };
  const auto arity = static_cast<std::size_t>(nodes);
  std::map<std::array<int, 3>, Face> faces;
  for (std::size_t cell = 0; cell * arity < ids.size(); ++cell)
    for (int side = 0; side < 4; ++side) {
      std::array<int, 3> key;
      for (std::size_t c = 0; c < 3; ++c)
        key[c] = ids[cell * arity + static_cast<std::size_t>(kFaces[side][c])];
      std::ranges::sort(key);
      Face& face = faces[key];
      ++face.count;
      face.cell = cell;
      face.side = side;
    }

  std::vector<TriangleMesh::Triangle> triangles;
  for (const auto& [key, face] : faces) {
    if (face.count != 1) continue;
    const std::span<const int> cell = ids.subspan(face.cell * arity, arity);
    const Vec3 first = at(cell[0]);
    const bool mirrored =
        (at(cell[1]) - first).cross(at(cell[2]) - first).dot(at(cell[3]) - first) < 0;
    const int* const nodes_of = kFaces[face.side];
    const auto add = [&](int a, int b, int c) {
      const auto node = [&](int n) { return cell[static_cast<std::size_t>(nodes_of[n])]; };
      triangles.push_back(mirrored ? TriangleMesh::Triangle{node(a), node(c), node(b)}
                                   : TriangleMesh::Triangle{node(a), node(b), node(c)});
    };
    if (nodes == 4) {
      add(0, 1, 2);
    } else {
      add(0, 3, 5);
      add(3, 1, 4);
      add(5, 4, 2);
      add(3, 4, 5);
    }
  }
  return triangles;
}

}  // namespace sim
