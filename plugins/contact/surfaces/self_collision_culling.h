// Self-collision culling: a quick test that an open sheet cannot touch itself in a step.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/math/vec3.h"

namespace sim {

// A grid of particles first + i cols + j with the triangles of grid_triangles().
struct SheetGrid {
  int first = 0, rows = 0, cols = 0;
};
// Empty if the surface is no grid, or too narrow for the vectors of any machine.
std::optional<SheetGrid> sheet_of(const TriangleMesh& surface);

// x maps the rectangle of the (i, j) into space, linearly in each triangle, with the derivative F.
// P projects orthogonally onto a plane with the axes e. If the symmetric part of P F is at least c
// in every triangle,
//   (P x(a) - P x(b)) . (a - b) >= c |a - b|^2,  hence  |x(a) - x(b)| >= c |a - b|,
// for the rectangle is convex: parts without a common corner, which are 1 / sqrt(2) apart in it,
// are c / sqrt(2) apart in space. The condition is convex in x, so that a motion on straight lines
// has it if both of its ends do.
using UnfoldedSheet = bool (*)(const double* const q[3], const SheetGrid& grid,
                               const double (&axes)[2][3], double c, double* scratch);
UnfoldedSheet unfolded_sheet();  // for this machine; scratch: 4 (cols + 8) numbers

class SelfCollisionCulling {
 public:
  explicit SelfCollisionCulling(const SheetGrid& grid)
      : grid_(grid), scratch_(4 * (static_cast<std::size_t>(grid.cols) + 8)) {}

  // True if all parts stay `distance` apart on straight paths from q0 to q1, by a plane between the
  // mean directions of rows and columns at the start; false if the test is inconclusive.
  bool stays_open(const std::array<const double*, 3>& q0, const std::array<const double*, 3>& q1,
                  double distance);

 private:
  SheetGrid grid_;
  std::vector<double> scratch_;
  UnfoldedSheet unfolded_ = unfolded_sheet();
};

}  // namespace sim
