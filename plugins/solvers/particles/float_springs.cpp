#include "float_springs.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sim {
namespace {

constexpr int kPad = 16;            // a vector of floats
constexpr double kSafeShift = 0.9;  // share of the shift that pushes may take
constexpr double kDamped = 0.8;     // of D^-1: between 1/2 and 2 of its eigenvalues, the best

template <class Number>
std::array<Number*, 6> six(const Layout& layout, Number* values) {
  std::array<Number*, 6> at;
  for (int entry = 0; entry < 6; ++entry)
    at[static_cast<std::size_t>(entry)] = layout.block(values, entry);
  return at;
}

}  // namespace

FloatSprings::FloatSprings(const Particles& system)
    : system_(&system), layout_(system.layout().n(), 3, kPad), doubles_(system.layout().n(), 1) {
  const int n = layout_.n(), count = static_cast<int>(system.runs().size());
  const Layout columns(n, 4 * count, kPad);
  memory_ = ArrayOf<float>(columns.size());
  for (int run = 0; run < count; ++run) {
    const auto column = [&](int k) { return columns.block(memory_.data(), 4 * run + k); };
    const SpringRun& from = *system.runs()[static_cast<std::size_t>(run)];
    runs_.push_back(
        {from.owners.data(), from.stride, column(0), {column(1), column(2), column(3)}});
  }
  shift_ = ArrayOf<float>(layout_.size());
  inverses_ = ArrayOf<float>(2 * layout_.size());
  blocks_ = Array(system.layout().size());
  exact_ = Array(system.layout().size());
  parts_ = Array(doubles_.size());
  if (system.nets().empty()) return;
  std::size_t ends = 0;
  for (int i = 0; i < n; ++i) {
    first_.push_back(static_cast<int>(ends));
    for (const Net* net : system.nets()) net->at(i, [&](int, double, double) { ++ends; });
  }
  first_.push_back(static_cast<int>(ends));
  ends_.resize(ends);
}

void FloatSprings::take(const StageMatrix& matrix) {
  const Stiffness& stiffness = matrix.stiffness();
  const double square = matrix.tau() * matrix.tau();
  const std::uint8_t* const free = system_->motion().free;
  double* const parts = doubles_.block(parts_.data(), 0);
  stiffness.find_parts(matrix.shifts(), square, free, kSafeShift, parts);
  scale_ = 1 / matrix.largest();
  float* const shift = layout_.block(shift_.data(), 0);
  const auto blocks = six(system_->layout(), blocks_.data());
  const auto exact = six(system_->layout(), exact_.data());
  const auto inverses = six(Layout(layout_.n(), 6, kPad), inverses_.data());
  const BlockKernels invert = block_kernels();
  system_->pool().run_parts(layout_.n(), kPad, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) shift[i] = static_cast<float>(scale_ * matrix.shift(i));
    for (std::size_t run = 0; run < runs_.size(); ++run)
      kernels_.narrow(stiffness.runs()[run], stiffness.positions(), parts, scale_ * square,
                      runs_[run], begin, end);
    if (ends_.empty()) return;
    for (int i = begin; i < end; ++i) {
      End* to = &ends_[static_cast<std::size_t>(first_[static_cast<std::size_t>(i)])];
      stiffness.net_at(i, [&](int other, const SpringStiffness& spring) {
        const double along =
            spring.along * (spring.along < 0 ? std::min(parts[i], parts[other]) : 1);
        const Vec3 w = std::sqrt(std::max(0.0, scale_ * square * spring.across)) *
                       (stiffness.position(i) - stiffness.position(other));
        *to++ = {other,
                 static_cast<float>(scale_ * square * along),
                 {static_cast<float>(w[0]), static_cast<float>(w[1]), static_cast<float>(w[2])}};
      });
    }
  });
  system_->pool().run_parts(layout_.n(), kPad, [&](int begin, int end) {
    kernels_.diagonal(runs_, shift, blocks.data(), begin, end);
    for (int i = begin; i < end && !ends_.empty(); ++i)
      for (int at = first_[static_cast<std::size_t>(i)];
           at < first_[static_cast<std::size_t>(i) + 1]; ++at) {
        const End& spring = ends_[static_cast<std::size_t>(at)];
        int entry = 0;
        for (int row = 0; row < 3; ++row)
          for (int col = row; col < 3; ++col)
            blocks[static_cast<std::size_t>(entry++)][i] +=
                static_cast<double>(spring.w[row]) * static_cast<double>(spring.w[col]) +
                (row == col ? static_cast<double>(spring.along) : 0.0);
      }
    invert.invert(blocks.data(), free, exact.data(), begin, end);
    for (std::size_t entry = 0; entry < 6; ++entry)
      for (int i = begin; i < end; ++i)
        inverses[entry][i] = static_cast<float>(kDamped * exact[entry][i]);
  });
}

FloatSpringProduct FloatSprings::product(const float* r, const float* x, float* out) const {
  FloatSpringProduct product{};
  product.runs = runs_;
  product.shift = layout_.block(shift_.data(), 0);
  std::ranges::copy(layout_.axes(r), product.r);
  std::ranges::copy(layout_.axes(x), product.x);
  std::ranges::copy(layout_.axes(out), product.out);
  std::ranges::copy(six(Layout(layout_.n(), 6, kPad), inverses_.data()), product.inverses);
  product.free = system_->motion().free;
  product.before = !ends_.empty();
  return product;
}

void FloatSprings::scale_rest(const float* r, float* out) const {
  const FloatSpringProduct f = product(r, r, out);
  system_->pool().run_parts(layout_.n(), kPad, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const float x = f.r[0][i], y = f.r[1][i], z = f.r[2][i];
      f.out[0][i] = f.inverses[0][i] * x + f.inverses[1][i] * y + f.inverses[2][i] * z;
      f.out[1][i] = f.inverses[1][i] * x + f.inverses[3][i] * y + f.inverses[4][i] * z;
      f.out[2][i] = f.inverses[2][i] * x + f.inverses[4][i] * y + f.inverses[5][i] * z;
    }
  });
}

// out := the product A x of the nets' springs
void FloatSprings::add_nets(const FloatSpringProduct& f, int begin, int end) const {
  for (int i = begin; i < end; ++i) {
    float sum[3] = {};
    for (int at = first_[static_cast<std::size_t>(i)]; at < first_[static_cast<std::size_t>(i) + 1];
         ++at) {
      const End& spring = ends_[static_cast<std::size_t>(at)];
      float e[3], s = 0;
      for (int axis = 0; axis < 3; ++axis) {
        e[axis] = f.x[axis][i] - f.x[axis][spring.to];
        s += spring.w[axis] * e[axis];
      }
      for (int axis = 0; axis < 3; ++axis) sum[axis] += spring.along * e[axis] + s * spring.w[axis];
    }
    for (int axis = 0; axis < 3; ++axis) f.out[axis][i] = sum[axis];
  }
}

void FloatSprings::residual(const float* r, const float* x, float* out) const {
  const FloatSpringProduct f = product(r, x, out);
  system_->pool().run_parts(layout_.n(), kPad, [&](int begin, int end) {
    if (f.before) add_nets(f, begin, end);
    kernels_.residual(f, begin, end);
  });
}

void FloatSprings::relax(const float* r, const float* x, float* out) const {
  const FloatSpringProduct f = product(r, x, out);
  system_->pool().run_parts(layout_.n(), kPad, [&](int begin, int end) {
    if (f.before) add_nets(f, begin, end);
    kernels_.relax(f, begin, end);
  });
}

}  // namespace sim
