#include "self_collision_culling.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "self_collision_culling_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// Projects one row onto the axes.
SIM_INLINE void project(const double* const q[3], std::int64_t first, int cols,
                        const double (&axes)[2][3], double* out[2]) {
  for (int axis = 0; axis < 2; ++axis) {
    const Doubles a = splat<double>(axes[axis][0]), b = splat<double>(axes[axis][1]),
                  c = splat<double>(axes[axis][2]);
    const auto at = [&](int j) {
      const V3<double> x = load(q, first + j);
      store(out[axis] + j, (a * x.x + b * x.y) + c * x.z);
    };
    for (int j = 0; j + kDoubles <= cols; j += kDoubles) at(j);
    at(cols - kDoubles);
  }
}

// `good` if both eigenvalues of a symmetric matrix are above c, 0 otherwise and for a value that is
// not a number; off: the sum of both entries off the diagonal.
SIM_INLINE Doubles definite(Doubles a, Doubles off, Doubles d, Doubles c, Doubles good) {
  const Doubles p = a - c, r = d - c, half = splat<double>(0.5) * off, zero{};
  good = p > zero ? good : zero;
  good = r > zero ? good : zero;
  return p * r - half * half > zero ? good : zero;
}

bool unfolded(const double* const q[3], const SheetGrid& grid, const double (&axes)[2][3], double c,
              double* scratch) {
  const int cols = grid.cols;
  double* rows[2][2];
  for (int k = 0; k < 4; ++k) rows[k / 2][k % 2] = scratch + k * (cols + 8);
  project(q, grid.first, cols, axes, rows[0]);
  const Doubles limit = splat<double>(c);
  for (int i = 0; i + 1 < grid.rows; ++i) {
    double** const low = rows[i % 2];
    double** const high = rows[1 - i % 2];
    project(q, grid.first + static_cast<std::int64_t>(i + 1) * cols, cols, axes, high);
    Doubles good = splat<double>(1);
    // (i, j) (i + 1, j) (i + 1, j + 1), and (i, j) (i + 1, j + 1) (i, j + 1).
    const auto cells = [&](int j) {
      Doubles corner[2][2][2];  // row, column, axis
      for (int column = 0; column < 2; ++column)
        for (int axis = 0; axis < 2; ++axis) {
          corner[0][column][axis] = load<double>(low[axis] + j + column);
          corner[1][column][axis] = load<double>(high[axis] + j + column);
        }
      for (int k = 0; k < 2; ++k) {
        const auto down = [&](int axis) { return corner[1][k][axis] - corner[0][k][axis]; };
        const auto along = [&](int axis) {
          return corner[1 - k][1][axis] - corner[1 - k][0][axis];
        };
        good = definite(down(0), down(1) + along(0), along(1), limit, good);
      }
    };
    const int count = cols - 1;
    for (int j = 0; j + kDoubles <= count; j += kDoubles) cells(j);
    cells(count - kDoubles);
    for (int lane = 0; lane < kDoubles; ++lane)
      if (!(good[lane] > 0)) return false;
  }
  return true;
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

UnfoldedSheet unfolded_sheet() { return SIM_CHOOSE(unfolded); }

}  // namespace sim
#endif
