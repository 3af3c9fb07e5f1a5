#include "core/particles/implicit/coarse_space.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

// Of a particle with its patch: velocity = u + w x arm for the six numbers (u, w), or
// P = [I, -[arm]x].
struct Six {
  double value[3][6];
};

Six motion_of(const Vec3& arm) {
  return {{{1, 0, 0, 0, arm[2], -arm[1]},
           {0, 1, 0, -arm[2], 0, arm[0]},
           {0, 0, 1, arm[1], -arm[0], 0}}};
}

// S P, S = along I + across d d^T.
Six times(double along, double across, const Vec3& d, const Six& motion) {
  Six out;
  for (int j = 0; j < 6; ++j) {
    double dot = 0;
    for (int axis = 0; axis < 3; ++axis) dot += d[axis] * motion.value[axis][j];
    for (int axis = 0; axis < 3; ++axis)
      out.value[axis][j] = along * motion.value[axis][j] + across * dot * d[axis];
  }
  return out;
}

double entry(const Six& left, int i, const Six& right, int j) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) sum += left.value[axis][i] * right.value[axis][j];
  return sum;
}

}  // namespace

CoarseSpace::CoarseSpace(const StageMatrix& matrix, std::span<const double> masses)
    : layout_(matrix.layout()) {
  Pairs pairs;
  matrix.stiffness().for_each([&](int a, int b, SpringStiffness) { pairs.emplace_back(a, b); });
  gather_patches(pairs, masses);
  arm_.resize(masses.size());
  const auto count = static_cast<std::size_t>(patches_);
  centre_.resize(count);
  size_.resize(count);
  count_.resize(count);

  // The pattern of the upper half, in an order of little fill.
  Pairs between;
  for (const auto& [a, b] : pairs)
    if (patch(a) >= 0 && patch(b) >= 0 && patch(a) != patch(b))
      between.push_back(std::minmax(patch(a), patch(b)));
  std::ranges::sort(between);
  between.erase(std::unique(between.begin(), between.end()), between.end());
  const std::vector<double> ones(count, 1.0);
  row_of_ = elimination_rows(ones, between);
  for (int& row : row_of_) row *= 6;
  Pairs entries;
  const auto add_block = [&](int low, int high) {
    for (int col = 0; col < 6; ++col)
      for (int row = 0; row <= (low == high ? col : 5); ++row)
        entries.emplace_back(low + row, high + col);
  };
  for (const int row : row_of_) add_block(row, row);
  const auto rows_of = [&](int a, int b) {
    return std::minmax(row_of_[static_cast<std::size_t>(a)], row_of_[static_cast<std::size_t>(b)]);
  };
  for (const auto& [a, b] : between) {
    const auto [low, high] = rows_of(a, b);
    add_block(low, high);
  }
  upper_.emplace(6 * patches_, entries);
  for (const int row : row_of_) diagonal_.push_back(target(row, row));
  for (const auto& [a, b] : pairs)
    if (patch(a) >= 0 && patch(b) >= 0 && patch(a) != patch(b)) {
      const auto [low, high] = rows_of(patch(a), patch(b));
      springs_.push_back(target(low, high));
    }
  coarse_.resize(6 * count);
  copy_.resize(6 * count);
}

CoarseSpace::Target CoarseSpace::target(int low, int high) const {
  Target target;
  for (int col = 0; col < 6; ++col) target.column[col] = upper_->entry(low, high + col);
  return target;
}

// From one particle along springs, the nearest first; what is left between patches joins one.
void CoarseSpace::gather_patches(const Pairs& pairs, std::span<const double> masses) {
  const std::size_t n = masses.size();
  std::vector<std::vector<int>> neighbours(n);
  for (const auto& [a, b] : pairs) {
    neighbours[static_cast<std::size_t>(a)].push_back(b);
    neighbours[static_cast<std::size_t>(b)].push_back(a);
  }
  const auto wanted =
      static_cast<std::size_t>(std::max(8.0, std::ceil(0.5 * std::sqrt(static_cast<double>(n)))));
  constexpr int kPinned = -1, kLeft = -2;
  patch_of_.assign(n, kLeft);
  for (std::size_t i = 0; i < n; ++i)
    if (std::isinf(masses[i])) patch_of_[i] = kPinned;
  std::vector<int> members;
  for (std::size_t first = 0; first < n; ++first) {
    if (patch_of_[first] != kLeft) continue;
    members.assign(1, static_cast<int>(first));
    patch_of_[first] = patches_;
    for (std::size_t at = 0; at < members.size() && members.size() < wanted; ++at)
      for (const int to : neighbours[static_cast<std::size_t>(members[at])])
        if (patch(to) == kLeft && members.size() < wanted) {
          patch_of_[static_cast<std::size_t>(to)] = patches_;
          members.push_back(to);
        }
    int other = kPinned;
    if (members.size() < wanted / 2)
      for (const int member : members)
        for (const int to : neighbours[static_cast<std::size_t>(member)])
          if (patch(to) >= 0 && patch(to) != patches_) other = patch(to);
    if (other < 0)
      ++patches_;
    else
      for (const int member : members) patch_of_[static_cast<std::size_t>(member)] = other;
  }
}

// Centres, and arms from there as shares of the size, so that all columns of P are alike.
void CoarseSpace::place_patches(const StageMatrix& matrix) {
  const int n = layout_.n();
  std::ranges::fill(centre_, Vec3::Zero());
  std::ranges::fill(size_, 0.0);
  std::ranges::fill(count_, 0);
  for (int i = 0; i < n; ++i) {
    if (patch(i) < 0) continue;
    centre_[static_cast<std::size_t>(patch(i))] += matrix.stiffness().position(i);
    ++count_[static_cast<std::size_t>(patch(i))];
  }
  for (std::size_t p = 0; p < centre_.size(); ++p) centre_[p] = centre_[p] / count_[p];
  for (int i = 0; i < n; ++i) {
    if (patch(i) < 0) continue;
    const auto p = static_cast<std::size_t>(patch(i));
    arm_[static_cast<std::size_t>(i)] = matrix.stiffness().position(i) - centre_[p];
    size_[p] = std::max(size_[p], arm_[static_cast<std::size_t>(i)].norm());
  }
  for (int i = 0; i < n; ++i)
    if (patch(i) >= 0) {
      Vec3& arm = arm_[static_cast<std::size_t>(i)];
      const double size = size_[static_cast<std::size_t>(patch(i))];
      arm = size > 0 ? Vec3(arm / size) : Vec3(Vec3::Zero());
    }
}

bool CoarseSpace::factorise(const StageMatrix& matrix) {
  constexpr double kLeast = 1e-10;  // of the diagonal: patches on a line have no third rotation
  place_patches(matrix);
  const std::span<double> values = upper_->values();
  std::ranges::fill(values, 0.0);
  const auto add_own = [&](int p, const Six& left, const Six& right) {
    const Target& at = diagonal_[static_cast<std::size_t>(p)];
    for (int col = 0; col < 6; ++col)
      for (int row = 0; row <= col; ++row)
        values[static_cast<std::size_t>(at.column[col] + row)] += entry(left, row, right, col);
  };
  const auto motion = [&](int i) { return motion_of(arm_[static_cast<std::size_t>(i)]); };
  for (int i = 0; i < layout_.n(); ++i)
    if (patch(i) >= 0)
      add_own(patch(i), motion(i), times(matrix.shift(i), 0, Vec3::Zero(), motion(i)));

  const double scale = matrix.tau() * matrix.tau();
  auto spring = springs_.begin();
  matrix.stiffness().for_each([&](int a, int b, SpringStiffness stiffness) {
    const Vec3 d = matrix.stiffness().position(a) - matrix.stiffness().position(b);
    const double along = scale * stiffness.along, across = scale * stiffness.across;
    const int pa = patch(a), pb = patch(b);
    if (pa < 0 && pb < 0) return;
    if (pa == pb) {
      // Only the turn of the patch changes d.
      Six change = motion(a);
      const Six other = motion(b);
      for (int axis = 0; axis < 3; ++axis)
        for (int col = 0; col < 6; ++col) change.value[axis][col] -= other.value[axis][col];
      add_own(pa, change, times(along, across, d, change));
      return;
    }
    if (pa >= 0) add_own(pa, motion(a), times(along, across, d, motion(a)));
    if (pb >= 0) add_own(pb, motion(b), times(along, across, d, motion(b)));
    if (pa < 0 || pb < 0) return;
    const Target& at = *spring++;
    const bool upper =
        row_of_[static_cast<std::size_t>(pa)] < row_of_[static_cast<std::size_t>(pb)];
    const Six low = motion(upper ? a : b), high = times(along, across, d, motion(upper ? b : a));
    for (int col = 0; col < 6; ++col)
      for (int row = 0; row < 6; ++row)
        values[static_cast<std::size_t>(at.column[col] + row)] -= entry(low, row, high, col);
  });
  for (const Target& at : diagonal_) {
    double most = 0;
    for (int col = 0; col < 6; ++col)
      most = std::max(most, values[static_cast<std::size_t>(at.column[col] + col)]);
    for (int col = 0; col < 6; ++col)
      values[static_cast<std::size_t>(at.column[col] + col)] += kLeast * most;
  }
  return patches_ > 0 && upper_->factorise();
}

double CoarseSpace::correct(const double* r, double* z) {
  const auto from = layout_.axes(r);
  const auto to = layout_.axes(z);
  std::ranges::fill(coarse_, 0.0);
  const auto each = [&](const auto& visit) {
    for (int i = 0; i < layout_.n(); ++i)
      if (patch(i) >= 0)
        visit(i, arm_[static_cast<std::size_t>(i)],
              &coarse_[static_cast<std::size_t>(row_of_[static_cast<std::size_t>(patch(i))])]);
  };
  each([&](int i, const Vec3& arm, double* out) {
    const double x = from[0][i], y = from[1][i], w = from[2][i];
    out[0] += x, out[1] += y, out[2] += w;
    out[3] += arm[1] * w - arm[2] * y;
    out[4] += arm[2] * x - arm[0] * w;
    out[5] += arm[0] * y - arm[1] * x;
  });
  std::ranges::copy(coarse_, copy_.begin());
  upper_->solve(coarse_);
  double sum = 0;
  for (std::size_t i = 0; i < copy_.size(); ++i) sum += copy_[i] * coarse_[i];
  each([&](int i, const Vec3& arm, const double* in) {
    to[0][i] += in[0] + in[4] * arm[2] - in[5] * arm[1];
    to[1][i] += in[1] + in[5] * arm[0] - in[3] * arm[2];
    to[2][i] += in[2] + in[3] * arm[1] - in[4] * arm[0];
  });
  return sum;
}

}  // namespace sim
