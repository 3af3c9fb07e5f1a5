#include "stage_matrix.h"

#include <algorithm>
#include <cmath>

#include "core/math/axes.h"

namespace sim {

StageMatrix::StageMatrix(Particles& system, std::function<bool()> stopped)
    : system_(&system),
      stopped_(std::move(stopped)),
      half_(system.layout().n(), 3),
      diagonal_(system.layout().n(), system.pool()),
      stiffness_(system),
      others_(system),
      shift_(Layout(system.layout().n(), 1).size()) {
  for (const SpringRun* run : system.runs()) reach_ = std::max(reach_, run->stride);
  reach_ = (reach_ + 7) / 8 * 8;
  if (!system.nets().empty()) reach_ = system.layout().n();
  if (others_.empty()) return;
  moved_ = Array(half_.size());
  sums_ = Array(half_.size());
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
  const auto blocks = diagonal_.entries();
  system_->pool().run_parts(half_.n(), 8, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) shift[i] = view.free(i) ? view.mass[i] + damping : 1.0;
  });
  if (!model.clamped && std::isfinite(model.share))
    stiffness_.soften(shift, tau * tau, system_->motion().free, model.share);
  system_->pool().run_parts(half_.n(), 8, [&](int begin, int end) {
    stiffness_.diagonal(shift, tau * tau, blocks.data(), begin, end);
  });
  // The symmetric part of the diagonal blocks of the other forces.
  const auto add = [&](std::span<const PluginForceJacobian::Block> others, double factor) {
    for (const auto& [i, j, value] : others) {
      if (i != j) continue;
      std::size_t entry = 0;
      for (int row = 0; row < 3; ++row)
        for (int col = row; col < 3; ++col)
          blocks[entry++][i] -= 0.5 * factor * (value(row, col) + value(col, row));
    }
  };
  add(others_.position_blocks(), tau * tau);
  add(others_.velocity_blocks(), tau);
  bounds_ = nullptr;
  restricted_ = false;
  system_->pool().run_parts(half_.n(), 8, [&](int begin, int end) {
    diagonal_.invert(system_->motion().free, begin, end);
  });
}

// The inverse of P D P on the range of each particle's projection P.
void StageMatrix::restrict_to(const VelocityInequalities* bounds) {
  bounds_ = bounds;
  restricted_ = false;
  if (!bounds) return;
  for (const VelocityInequality& bound : *bounds) {
    const int block = bound.particle / 8 * 8;
    diagonal_.invert(system_->motion().free, block, block + 8);
  }
  for (const VelocityInequality& bound : *bounds) {
    if (bound.active == 0 && bound.friction_model.drag == 0) continue;
    restricted_ = true;
    diagonal_.invert_within(bound.particle, diagonal(bound.particle) + bound.friction_model.slope(),
                            bound.free_directions);
  }
}

double StageMatrix::apply(const double* p, double* out) {
  StiffProduct product{};
  std::ranges::copy(half_.axes(p), product.p);
  std::ranges::copy(half_.axes(out), product.out);
  product.shift = Layout(half_.n(), 1).block(shift_.data(), 0);
  product.scale = tau_ * tau_;
  product.free = system_->motion().free;
  double dot = diagonal_.over_tiles(
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

double StageMatrix::turn_and_apply(double beta, const double* z, double* p, double* out) {
  diagonal_.turn(beta, z, p);
  return apply(p, out);
}

std::vector<std::array<int, 2>> StageMatrix::fixed_pairs() const {
  std::vector<std::array<int, 2>> pairs;
  stiffness_.for_each([&](int a, int b, SpringStiffness) { pairs.push_back({a, b}); });
  return pairs;
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

double StageMatrix::largest() const {
  double most = 0;
  for (const double* const d : diagonal_.trace())
    for (int i = 0; i < half_.n(); ++i) most = std::max(most, d[i]);
  return most;
}

double StageMatrix::stiffness_ratio() const {
  double most = 1;
  for (const double* const d : diagonal_.trace())
    for (int i = 0; i < half_.n(); ++i)
      if (bit(system_->motion().free, i)) most = std::max(most, d[i] / shift(i));
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
  const auto trace = diagonal_.trace();
  // The stiffness of forces without blocks is not known.
  const bool known = others_.without_blocks().empty();
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* const d = trace[axis];
    for (int i = 0; i < half_.n(); ++i) {
      if (!view.free(i)) continue;
      const double of_forces = known ? std::max(0.0, 1 - view.mass[i] / std::fabs(d[i])) : 1;
      const double size = of_forces * std::fabs(q[axis][i]) / tau_ + std::fabs(v[axis][i]);
      sum += std::fabs(d[i]) * size * size;
    }
  }
  return std::numeric_limits<double>::epsilon() * std::sqrt(sum);
}

}  // namespace sim
