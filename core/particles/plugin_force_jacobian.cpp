#include "core/particles/plugin_force_jacobian.h"

#include <algorithm>
#include <cmath>

#include "core/base/memory.h"

namespace sim {
namespace {

class Collector final : public JacobianSink {
 public:
  using Blocks = std::vector<PluginForceJacobian::Block>;
  Collector(Blocks& position, Blocks& velocity) : position_(&position), velocity_(&velocity) {}

  void position(int i, int j, const Mat3& block) override { position_->push_back({i, j, block}); }
  void velocity(int i, int j, const Mat3& block) override { velocity_->push_back({i, j, block}); }

 private:
  Blocks *position_, *velocity_;
};

class Counter final : public JacobianSink {
 public:
  std::size_t positions = 0, velocities = 0;
  void position(int, int, const Mat3&) override { ++positions; }
  void velocity(int, int, const Mat3&) override { ++velocities; }
};

void add_blocks(std::span<const PluginForceJacobian::Block> blocks, const double* const d[3],
                ForceSink sink) {
  for (const auto& [i, j, value] : blocks) sink.add(i, value * Vec3(d[0][j], d[1][j], d[2][j]));
}

double largest(const double* const values[3], int n) {
  double most = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < n; ++i) most = std::max(most, std::abs(values[axis][i]));
  return most;
}

}  // namespace

PluginForceJacobian::PluginForceJacobian(const Particles& particles)
    : particles_(&particles), half_(particles.layout().n(), 3) {
  for (Force* force : particles.other_forces())
    (force->has_jacobian() ? with_blocks_ : without_).push_back(force);
  if (without_.empty()) return;
  moved_ = Array(half_.size());
  sums_ = Array(half_.size());
}

std::optional<std::vector<std::array<int, 2>>> PluginForceJacobian::couplings() const {
  std::vector<std::array<int, 2>> pairs;
  if (!without_.empty()) return {};
  for (const Force* force : with_blocks_)
    if (!force->couplings(pairs)) return {};
  return pairs;
}

void PluginForceJacobian::at(const ParticleView& view) {
  view_ = view;
  position_.clear();
  velocity_.clear();
  if (with_blocks_.empty()) return;
  if (position_.capacity() + velocity_.capacity() == 0) make_room();
  Collector collector(position_, velocity_);
  give_blocks(collector);
}

void PluginForceJacobian::give_blocks(JacobianSink& sink) {
  for (Force* force : with_blocks_) {
    const ParticleView own = particles_->seen_by(*force, view_);
    force->prepare(own, particles_->pool());
    force->jacobian(own, sink);
  }
}

// Long-range pair forces can have gigabytes of blocks: they are counted before they are stored.
void PluginForceJacobian::make_room() {
  Counter counter;
  give_blocks(counter);
  require_memory(static_cast<double>((counter.positions + counter.velocities) * sizeof(Block)),
                 "the derivatives of forces on " + std::to_string(view_.n) + " particles need", "",
                 "take fewer particles, or a smaller cutoff");
  position_.reserve(counter.positions);
  velocity_.reserve(counter.velocities);
}

void PluginForceJacobian::add(const double* const dq[3], const double* const dv[3],
                              ForceSink sink) {
  add_blocks(position_, dq, sink);
  add_blocks(velocity_, dv, sink);
  if (!without_.empty()) add_differences(dq, dv, sink);
}

// J d = (f(x + e d) - f(x - e d)) / 2e + O(e^2), first for d = dq, then for d = dv. Truncation and
// rounding balance where e d is the cube root of the machine precision of x.
void PluginForceJacobian::add_differences(const double* const dq[3], const double* const dv[3],
                                          ForceSink sink) {
  constexpr double kCubeRootOfPrecision = 6e-6;
  double* moved[3];
  double* sums[3];
  for (int axis = 0; axis < 3; ++axis) {
    moved[axis] = half_.block(moved_.data(), axis);
    sums[axis] = half_.block(sums_.data(), axis);
  }
  const auto add_along = [&](const double* const d[3], const double* const x[3],
                             const ParticleView& view, std::span<Force* const> forces) {
    const double size = largest(d, view_.n);
    if (size == 0) return;
    const double e = kCubeRootOfPrecision * std::max(largest(x, view_.n), 1e-3) / size;
    std::ranges::fill(sums_.span(), 0.0);
    for (const double sign : {-1.0, 1.0}) {
      ++evaluations_;
      for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < view_.n; ++i) {
          moved[axis][i] = x[axis][i] + sign * e * d[axis][i];
          sums[axis][i] = -sums[axis][i];
        }
      for (Force* force : forces) {
        const ParticleView own = particles_->seen_by(*force, view);
        force->prepare(own, particles_->pool());
        force->accumulate(own, {0, view_.n}, {sums[0], sums[1], sums[2]});
      }
    }
    double* const out[3] = {sink.x, sink.y, sink.z};
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < view_.n; ++i) out[axis][i] += sums[axis][i] / (2 * e);
  };

  ParticleView view = view_;
  view.x = moved[0], view.y = moved[1], view.z = moved[2];
  const double* const x[3] = {view_.x, view_.y, view_.z};
  add_along(dq, x, view, without_);

  if (std::ranges::none_of(without_, [](const Force* f) { return f->depends_on_velocity(); }))
    return;
  view = view_;
  view.vx = moved[0], view.vy = moved[1], view.vz = moved[2];
  const double* const v[3] = {view_.vx, view_.vy, view_.vz};
  add_along(dv, v, view, without_);
}

}  // namespace sim
