#include "core/particles/implicit/stage_matrix.h"

#include <algorithm>
#include <cmath>

#include "core/particles/axes.h"
#include "core/simd/lanes.h"

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

constexpr int kTile = 512;  // particles, fixed, so that sums do not depend on the number of threads

// The six blocks of an array in Layout(n, 6).
struct SixBlocks {
  double* at[6];
  SixBlocks(const Layout& layout, double* values) {
    for (int entry = 0; entry < 6; ++entry) at[entry] = layout.block(values, entry);
  }
};

}  // namespace

StageMatrix::StageMatrix(Particles& system, std::function<bool()> stopped)
    : system_(&system),
      stopped_(std::move(stopped)),
      half_(system.layout().n(), 3),
      kernels_(block_kernels()),
      stiffness_(system),
      others_(system),
      shift_(Layout(system.layout().n(), 1).size()),
      blocks_(system.layout().size()),
      inverses_(system.layout().size()),
      tile_sums_(static_cast<std::size_t>((system.layout().n() + kTile - 1) / kTile)) {
  for (const SpringRun* run : system.runs()) reach_ = std::max(reach_, run->stride);
  reach_ = (reach_ + 7) / 8 * 8;
  if (!system.nets().empty()) reach_ = system.layout().n();
  if (others_.empty()) return;
  moved_ = Array(half_.size());
  sums_ = Array(half_.size());
}

// Sums what body(begin, end, lanes) adds in eight lanes over all tiles, in a fixed order.
template <class Body>
double StageMatrix::over_tiles(const Body& body) {
  const int n = half_.n(), tiles = static_cast<int>(tile_sums_.size());
  system_->pool().run_parts(tiles, 1, [&](int begin, int end) {
    for (int tile = begin; tile < end; ++tile) {
      double lanes[8] = {};
      body(tile * kTile, std::min((tile + 1) * kTile, n), lanes);
      tile_sums_[static_cast<std::size_t>(tile)] = sum_of(lanes);
    }
  });
  double total = 0;
  for (const double sum : tile_sums_) total += sum;
  return total;
}

void StageMatrix::at(const ParticleView& view, double tau, const Model& model,
                     const double* const* before) {
  tau_ = tau;
  const double* const q[3] = {view.x, view.y, view.z};
  stiffness_.at(q, {model.clamped, before});
  others_.at(view);
  const int n = half_.n();
  const double damping = tau * system_->motion().damping;
  double* const shift = Layout(n, 1).block(shift_.data(), 0);
  const SixBlocks blocks(system_->layout(), blocks_.data());
  system_->pool().run_parts(half_.n(), 8, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) shift[i] = view.free(i) ? view.mass[i] + damping : 1.0;
  });
  if (!model.clamped && std::isfinite(model.share))
    stiffness_.soften(shift, tau * tau, system_->motion().free, model.share);
  system_->pool().run_parts(half_.n(), 8, [&](int begin, int end) {
    stiffness_.diagonal(shift, tau * tau, blocks.at, begin, end);
  });
  // The symmetric part of the diagonal blocks of the other forces.
  const auto add = [&](std::span<const PluginForceJacobian::Block> others, double factor) {
    for (const auto& [i, j, value] : others) {
      if (i != j) continue;
      int entry = 0;
      for (int row = 0; row < 3; ++row)
        for (int col = row; col < 3; ++col)
          blocks.at[entry++][i] -= 0.5 * factor * (value(row, col) + value(col, row));
    }
  };
  add(others_.position_blocks(), tau * tau);
  add(others_.velocity_blocks(), tau);
  bounds_ = nullptr;
  restricted_ = false;
  system_->pool().run_parts(half_.n(), 8, [&](int begin, int end) { invert(begin, end); });
}

void StageMatrix::invert(int begin, int end) {
  const SixBlocks blocks(system_->layout(), blocks_.data());
  const SixBlocks inverses(system_->layout(), inverses_.data());
  kernels_.invert(blocks.at, system_->motion().free, inverses.at, begin, end);
}

// The inverse of P D P on the range of each particle's projection P.
void StageMatrix::restrict_to(const VelocityInequalities* bounds) {
  bounds_ = bounds;
  restricted_ = false;
  if (!bounds) return;
  for (const VelocityInequality& bound : *bounds) {
    const int block = bound.particle / 8 * 8;
    invert(block, block + 8);
  }
  const SixBlocks inverses(system_->layout(), inverses_.data());
  for (const VelocityInequality& bound : *bounds) {
    if (bound.active == 0 && bound.friction_model.drag == 0) continue;
    restricted_ = true;
    const Mat3 inverse = inverse_within(diagonal(bound.particle) + bound.friction_model.slope(),
                                        bound.free_directions);
    int entry = 0;
    for (int row = 0; row < 3; ++row)
      for (int col = row; col < 3; ++col) inverses.at[entry++][bound.particle] = inverse(row, col);
  }
}

double StageMatrix::apply(const double* p, double* out) {
  StiffProduct product{};
  std::ranges::copy(half_.axes(p), product.p);
  std::ranges::copy(half_.axes(out), product.out);
  product.shift = Layout(half_.n(), 1).block(shift_.data(), 0);
  product.scale = tau_ * tau_;
  product.free = system_->motion().free;
  double dot = over_tiles(
      [&](int begin, int end, double(&lanes)[8]) { stiffness_.apply(product, begin, end, lanes); });
  if (!others_.empty()) apply_others(p, out);
  if (restricted_) dot += apply_drag(p, out);
  project_directions(out);
  return dot;
}

// out += (drag of friction) p; returns what this adds to p.out.
double StageMatrix::apply_drag(const double* p, double* out) const {
  const auto from = half_.axes(p);
  const auto to = half_.axes(out);
  double sum = 0;
  for (const VelocityInequality& bound : *bounds_) {
    if (bound.friction_model.drag == 0) continue;
    const int i = bound.particle;
    const Vec3 v = vector_at(from, i), force = bound.friction_model.slope() * v;
    put_vector(to, i, vector_at(to, i) + force);
    sum += v.dot(force);
  }
  return sum;
}

void StageMatrix::project_directions(double* r) const {
  if (!restricted_) return;
  const auto to = half_.axes(r);
  for (const VelocityInequality& bound : *bounds_) {
    if (bound.active == 0) continue;
    const int i = bound.particle;
    put_vector(to, i, bound.free_directions * vector_at(to, i));
  }
}

// out -= (tau^2 dF/dq + tau dF/dv) p
void StageMatrix::apply_others(const double* p, double* out) {
  for (std::size_t i = 0; i < half_.size(); ++i) moved_[i] = tau_ * p[i];
  std::ranges::fill(sums_.span(), 0.0);
  const auto dq = half_.axes(std::as_const(moved_).data()), dv = half_.axes(p);
  const auto sums = half_.axes(sums_.data()), to = half_.axes(out);
  others_.add(dq.data(), dv.data(), {sums[0], sums[1], sums[2]});
  const std::uint8_t* const free = system_->motion().free;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < half_.n(); ++i)
      if (bit(free, i)) to[axis][i] -= tau_ * sums[axis][i];
}

double StageMatrix::precondition(const double* r, double* z) {
  const SixBlocks inverses(system_->layout(), inverses_.data());
  const auto from = half_.axes(r);
  const auto to = half_.axes(z);
  return over_tiles([&](int begin, int end, double(&lanes)[8]) {
    kernels_.multiply(inverses.at, from.data(), to.data(), begin, end, lanes);
  });
}

double StageMatrix::turn_and_apply(double beta, const double* z, double* p, double* out) {
  const auto from = half_.axes(z);
  const auto to = half_.axes(p);
  system_->pool().run_parts(half_.n(), 8, [&](int begin, int end) {
    kernels_.turn(beta, from.data(), to.data(), begin, end);
  });
  return apply(p, out);
}

double StageMatrix::advance(double alpha, const double* p, const double* ap, double* d, double* r,
                            double* z) {
  const SixBlocks inverses(system_->layout(), inverses_.data());
  const auto step = half_.axes(p), change = half_.axes(ap);
  const auto to = half_.axes(d), rest = half_.axes(r), out = half_.axes(z);
  return over_tiles([&](int begin, int end, double(&lanes)[8]) {
    kernels_.advance(alpha, step.data(), change.data(), to.data(), rest.data(), inverses.at,
                     out.data(), begin, end, lanes);
  });
}

void StageMatrix::for_each_pair(const VisitPair& spring, const VisitPair& other) const {
  stiffness_.for_each([&](int a, int b, SpringStiffness stiffness) {
    const Vec3 d = stiffness_.position(a) - stiffness_.position(b);
    Mat3 block;
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t col = 0; col < 3; ++col)
        block(row, col) =
            -tau_ * tau_ *
            (stiffness.across * d[row] * d[col] + (row == col ? stiffness.along : 0.0));
    spring(a, b, block);
  });
  for (const auto& [i, j, block] : others_.position_blocks())
    if (i != j) other(i, j, 0.5 * (-tau_ * tau_) * block);
  for (const auto& [i, j, block] : others_.velocity_blocks())
    if (i != j) other(i, j, 0.5 * -tau_ * block);
}

double StageMatrix::shift(int i) const { return Layout(half_.n(), 1).block(shift_.data(), 0)[i]; }

Mat3 StageMatrix::diagonal(int i) const {
  Mat3 block;
  int entry = 0;
  for (int row = 0; row < 3; ++row)
    for (int col = row; col < 3; ++col)
      block(row, col) = block(col, row) = system_->layout().block(blocks_.data(), entry++)[i];
  return block;
}

double StageMatrix::largest() const {
  double most = 0;
  for (const int entry : {0, 3, 5}) {
    const double* const d = system_->layout().block(blocks_.data(), entry);
    for (int i = 0; i < half_.n(); ++i) most = std::max(most, d[i]);
  }
  return most;
}

double StageMatrix::stiffness_ratio() const {
  double most = 1;
  for (const int entry : {0, 3, 5}) {
    const double* const d = system_->layout().block(blocks_.data(), entry);
    for (int i = 0; i < half_.n(); ++i)
      if (bit(system_->motion().free, i)) most = std::max(most, d[i] / shift(i));
  }
  return most;
}

double StageMatrix::majorant(const double* p) const {
  const auto v = half_.axes(p);
  const auto at = [&](int i) { return Vec3(v[0][i], v[1][i], v[2][i]); };
  const double* const shift = Layout(half_.n(), 1).block(shift_.data(), 0);
  double sum = 0, springs = 0;
  for (int i = 0; i < half_.n(); ++i) sum += shift[i] * at(i).squaredNorm();
  for (std::size_t k = 0; bounds_ && k < bounds_->size(); ++k)
    sum += (*bounds_)[k].friction_model.drag * at((*bounds_)[k].particle).squaredNorm();
  stiffness_.for_each([&](int a, int b, const SpringStiffness& spring) {
    const double square = (stiffness_.position(a) - stiffness_.position(b)).squaredNorm();
    springs += (spring.along + spring.across * square) * (at(a) - at(b)).squaredNorm();
  });
  return sum + tau_ * tau_ * springs;
}

double StageMatrix::largest_turn(const double* p) const {
  const auto v = half_.axes(p);
  double most = 0;
  stiffness_.for_each([&](int a, int b, const SpringStiffness&) {
    const Vec3 e(v[0][a] - v[0][b], v[1][a] - v[1][b], v[2][a] - v[2][b]);
    const Vec3 d = stiffness_.position(a) - stiffness_.position(b);
    most = std::max(most, e.squaredNorm() / d.squaredNorm());
  });
  return tau_ * std::sqrt(most);
}

double StageMatrix::rounding(const ParticleView& view) const {
  const double* const q[3] = {view.x, view.y, view.z};
  const double* const v[3] = {view.vx, view.vy, view.vz};
  constexpr int kDiagonal[3] = {0, 3, 5};
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double* const d = system_->layout().block(blocks_.data(), kDiagonal[axis]);
    for (int i = 0; i < half_.n(); ++i) {
      if (!view.free(i)) continue;
      const double size = std::fabs(q[axis][i]) / tau_ + std::fabs(v[axis][i]);
      sum += std::fabs(d[i]) * size * size;
    }
  }
  return std::numeric_limits<double>::epsilon() * std::sqrt(sum);
}

}  // namespace sim
