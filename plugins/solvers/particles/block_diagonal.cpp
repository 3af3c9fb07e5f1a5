#include "block_diagonal.h"

#include <cmath>

namespace sim {
namespace {

// P (P D P)^-1 P, the inverse of D on the range of the projection P; like the kernel, 1/|trace| if
// D is not positive definite there.
Mat3 inverse_within(const Mat3& d, const Mat3& paths) {
  Vec3 basis[3], towards[3];
  int size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {  // conjugate directions
    Vec3 e = paths.column(axis);
    for (int j = 0; j < size; ++j) e -= e.dot(towards[j]) * basis[j];
    if (!(e.squaredNorm() > 1e-12)) continue;
    const double curvature = e.dot(d * e);
    if (!(curvature > 1e-14 * e.squaredNorm() * (d(0, 0) + d(1, 1) + d(2, 2))))
      return 1 / std::fabs(d(0, 0) + d(1, 1) + d(2, 2)) * paths;
    basis[size] = e / std::sqrt(curvature);
    towards[size] = d * basis[size];
    ++size;
  }
  Mat3 inverse;
  for (int j = 0; j < size; ++j) inverse += outer(basis[j], basis[j]);
  return inverse;
}

}  // namespace

BlockDiagonal::BlockDiagonal(int n, ThreadPool& pool)
    : n_(n),
      pool_(&pool),
      half_(n, 3),
      six_(n, 6),
      blocks_(six_.size()),
      inverses_(six_.size()),
      tile_sums_(static_cast<std::size_t>((n + kTile - 1) / kTile)) {}

std::array<double*, 6> BlockDiagonal::pointers(Array& values) const {
  std::array<double*, 6> entries;
  for (int entry = 0; entry < 6; ++entry)
    entries[static_cast<std::size_t>(entry)] = six_.block(values.data(), entry);
  return entries;
}

Mat3 BlockDiagonal::block(int i) const {
  Mat3 block;
  int entry = 0;
  for (int row = 0; row < 3; ++row)
    for (int col = row; col < 3; ++col)
      block(row, col) = block(col, row) = six_.block(blocks_.data(), entry++)[i];
  return block;
}

std::array<const double*, 3> BlockDiagonal::trace() const {
  const double* const values = blocks_.data();
  return {six_.block(values, 0), six_.block(values, 3), six_.block(values, 5)};
}

void BlockDiagonal::invert(const std::uint8_t* free, int begin, int end) {
  kernels_.invert(pointers(blocks_).data(), free, pointers(inverses_).data(), begin, end);
}

void BlockDiagonal::invert_within(int i, const Mat3& block, const Mat3& projection) {
  const auto inverses = pointers(inverses_);
  const Mat3 inverse = inverse_within(block, projection);
  std::size_t entry = 0;
  for (int row = 0; row < 3; ++row)
    for (int col = row; col < 3; ++col) inverses[entry++][i] = inverse(row, col);
}

double BlockDiagonal::multiply(const double* r, double* z) {
  const auto inverses = pointers(inverses_);
  const auto from = half_.axes(r);
  const auto to = half_.axes(z);
  return over_tiles([&](int begin, int end, double(&lanes)[8]) {
    kernels_.multiply(inverses.data(), from.data(), to.data(), begin, end, lanes);
  });
}

void BlockDiagonal::turn(double beta, const double* z, double* p) {
  const auto from = half_.axes(z);
  const auto to = half_.axes(p);
  pool_->run_parts(
      n_, 8, [&](int begin, int end) { kernels_.turn(beta, from.data(), to.data(), begin, end); });
}

double BlockDiagonal::advance(double alpha, const double* p, const double* ap, double* d, double* r,
                              double* z) {
  const auto inverses = pointers(inverses_);
  const auto step = half_.axes(p), change = half_.axes(ap);
  const auto to = half_.axes(d), rest = half_.axes(r), out = half_.axes(z);
  return over_tiles([&](int begin, int end, double(&lanes)[8]) {
    kernels_.advance(alpha, step.data(), change.data(), to.data(), rest.data(), inverses.data(),
                     out.data(), begin, end, lanes);
  });
}

double dot(const Array& a, const Array& b) {
  double lanes[8] = {};
  block_kernels().dot(a.data(), b.data(), a.size(), lanes);
  return sum_of(lanes);
}

void add_scaled(Array& to, double factor, const Array& a) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += factor * a[i];
}

}  // namespace sim
