#include "aggregate_matrix.h"

#include <algorithm>
#include <cmath>

#include "chebyshev.h"

namespace sim {
namespace {

constexpr int kFewPatches = 16;    // whose matrix is factorised
constexpr int kWantedPatches = 4;  // of a coarser one

WeightedGraph with_diagonal(const WeightedGraph& between) {
  WeightedGraph graph;
  for (int i = 0; i < between.nodes(); ++i) {
    graph.begin.push_back(static_cast<int>(graph.to.size()));
    bool own = false;
    for (int at = between.begin[static_cast<std::size_t>(i)];
         at < between.begin[static_cast<std::size_t>(i) + 1]; ++at) {
      const int to = between.to[static_cast<std::size_t>(at)];
      if (!own && to > i) graph.to.push_back(i), own = true;
      graph.to.push_back(to);
    }
    if (!own) graph.to.push_back(i);
  }
  graph.begin.push_back(static_cast<int>(graph.to.size()));
  return graph;
}

// inverse := (L L^T)^-1 of the 6 x 6 block; false if it is not positive definite.
bool invert(const double* block, float* inverse) {
  constexpr int kRow = AggregateKernels::kRow;
  double l[6][6], over[6];  // over: 1 / l_ii
  for (int col = 0; col < 6; ++col) {
    double own = block[col * kRow + col];
    for (int k = 0; k < col; ++k) own -= l[col][k] * l[col][k];
    if (!(own > 0)) return false;
    over[col] = 1 / std::sqrt(own);
    for (int row = col + 1; row < 6; ++row) {
      double sum = block[col * kRow + row];
      for (int k = 0; k < col; ++k) sum -= l[row][k] * l[col][k];
      l[row][col] = sum * over[col];
    }
  }
  // The columns of L^-1, and of L^-T L^-1.
  double m[6][6];
  for (int col = 0; col < 6; ++col) {
    m[col][col] = over[col];
    for (int row = col + 1; row < 6; ++row) {
      double sum = 0;
      for (int k = col; k < row; ++k) sum -= l[row][k] * m[k][col];
      m[row][col] = sum * over[row];
    }
  }
  for (int col = 0; col < 6; ++col)
    for (int row = col; row < 6; ++row) {
      double sum = 0;
      for (int k = row; k < 6; ++k) sum += m[k][row] * m[k][col];
      inverse[col * kRow + row] = inverse[row * kRow + col] = static_cast<float>(sum);
    }
  return true;
}

// to += Q^T from, with Q = [I, -[arm]x; 0, turn I].
inline void add_turned(const Vec3& arm, double turn, const double* from, double* to) {
  for (int k = 0; k < 3; ++k) to[k] += from[k];
  to[3] += arm[1] * from[2] - arm[2] * from[1] + turn * from[3];
  to[4] += arm[2] * from[0] - arm[0] * from[2] + turn * from[4];
  to[5] += arm[0] * from[1] - arm[1] * from[0] + turn * from[5];
}

}  // namespace

AggregateMatrix::AggregateMatrix(const WeightedGraph& between, int steps, Spectrum spectrum)
    : spectrum_(spectrum),
      steps_(static_cast<std::size_t>(steps)),
      pattern_(with_diagonal(between)) {
  constexpr double kMostOfSprings = 2;
  chebyshev_steps(kMostOfSprings, steps_);
  const auto n = static_cast<std::size_t>(count());
  blocks_ = Array(pattern_.to.size() * kBlock);
  narrow_ = ArrayOf<float>(blocks_.size());
  inverses_ = ArrayOf<float>(n * kBlock);
  rest_ = Array(n * kRow);
  if (spectrum == Spectrum::kEstimated)
    for (Array* array : {&none_, &trial_}) *array = Array(n * kRow);
  centres_.resize(n);
  sizes_.resize(n);
  for (int i = 0; i < count(); ++i) own_.push_back(place(i, i));
  mirror_.assign(pattern_.to.size(), -1);
  for (int i = 0; i < count(); ++i)
    for (int at = pattern_.begin[static_cast<std::size_t>(i)];
         at < own_[static_cast<std::size_t>(i)]; ++at)
      mirror_[static_cast<std::size_t>(at)] = place(pattern_.to[static_cast<std::size_t>(at)], i);
  make_coarser(between);
}

void AggregateMatrix::make_coarser(const WeightedGraph& between) {
  const auto n = static_cast<std::size_t>(count());
  if (count() > kFewPatches) {
    aggregates_ = aggregate(between, std::vector<std::uint8_t>(n), kWantedPatches);
    if (3 * aggregates_.count <= 2 * count())
      coarser_ =
          std::make_unique<AggregateMatrix>(graph_between(between, aggregates_), 2, spectrum_);
  }
  if (!coarser_) {
    std::vector<std::pair<int, int>> upper;
    for (int i = 0; i < count(); ++i)
      for (int at = own_[static_cast<std::size_t>(i)];
           at < pattern_.begin[static_cast<std::size_t>(i) + 1]; ++at)
        for (int row = 0; row < 6; ++row)
          for (int column = pattern_.to[static_cast<std::size_t>(at)] == i ? row : 0; column < 6;
               ++column)
            upper.emplace_back(6 * i + row, 6 * pattern_.to[static_cast<std::size_t>(at)] + column);
    factor_.emplace(6 * count(), upper);
    direct_.resize(6 * n);
    return;
  }
  arms_.resize(n);
  turns_.resize(n);
  for (Array* array : {&r_, &x_, &again_})
    *array = Array(static_cast<std::size_t>(coarser_->count()) * kRow);
  for (int i = 0; i < count(); ++i)
    for (int at = pattern_.begin[static_cast<std::size_t>(i)];
         at < pattern_.begin[static_cast<std::size_t>(i) + 1]; ++at) {
      const int low = aggregates_.of[static_cast<std::size_t>(i)];
      const int high =
          aggregates_.of[static_cast<std::size_t>(pattern_.to[static_cast<std::size_t>(at)])];
      place_in_coarser_.push_back(low <= high ? coarser_->place(low, high) : -1);
    }
}

int AggregateMatrix::place(int i, int j) const {
  const auto first = pattern_.to.begin() + pattern_.begin[static_cast<std::size_t>(i)];
  const auto last = pattern_.to.begin() + pattern_.begin[static_cast<std::size_t>(i) + 1];
  return static_cast<int>(std::lower_bound(first, last, j) - pattern_.to.begin());
}

void AggregateMatrix::clear() { std::ranges::fill(blocks_.span(), 0.0); }

void AggregateMatrix::mirror() {
  for (std::size_t at = 0; at < mirror_.size(); ++at) {
    if (mirror_[at] < 0) continue;
    double* const to = block(static_cast<int>(at));
    const double* const from = block(mirror_[at]);
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column < 6; ++column)
        to[column * kRow + row] = from[row * kRow + column];
  }
}

// Collinear aggregates lack one rotation, so that the diagonal is raised by a small share.
bool AggregateMatrix::invert_own() {
  constexpr double kLeast = 1e-10;
  for (int i = 0; i < count(); ++i) {
    double* const own = this->own(i);
    double most = 0;
    for (int k = 0; k < 6; ++k) most = std::max(most, own[k * kRow + k]);
    for (int k = 0; k < 6; ++k) own[k * kRow + k] += kLeast * most;
    if (!invert(own, &inverses_[static_cast<std::size_t>(i) * kBlock])) return false;
  }
  return true;
}

bool AggregateMatrix::prepare() {
  mirror();
  if (!invert_own()) return false;
  std::ranges::transform(blocks_.span(), narrow_.data(),
                         [](double b) { return static_cast<float>(b); });
  if (!coarser_) return factorise();
  if (spectrum_ == Spectrum::kEstimated) chebyshev_steps(largest_eigenvalue(), steps_);
  return prepare_coarser();
}

// An estimate of that of D^-1 B with a margin, since power iteration comes from below.
double AggregateMatrix::largest_eigenvalue() {
  constexpr int kTurns = 10;
  constexpr double kMargin = 1.1;
  Array& x = trial_;
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = i % kRow < 6 ? 1 + static_cast<double>(i % 7) : 0;
  return kMargin * power_iteration(x, kTurns, [&](double factor) {
           kernels_.residual(pattern_, narrow_.data(), none_.data(), x.data(), rest_.data(), 0,
                             count());
           kernels_.relax(inverses_.data(), -factor, rest_.data(), x.data(), false, 0, count());
         });
}

void AggregateMatrix::place_coarser() {
  std::vector<Vec3>& centres = coarser_->centres();
  std::vector<double>& sizes = coarser_->sizes();
  std::ranges::fill(centres, Vec3::Zero());
  std::ranges::fill(sizes, 0.0);  // counts first
  for (std::size_t i = 0; i < centres_.size(); ++i) {
    const auto p = static_cast<std::size_t>(aggregates_.of[i]);
    centres[p] += centres_[i];
    sizes[p] += 1;
  }
  for (std::size_t p = 0; p < centres.size(); ++p) {
    centres[p] = centres[p] / sizes[p];
    sizes[p] = 0;
  }
  for (std::size_t i = 0; i < centres_.size(); ++i) {
    const auto p = static_cast<std::size_t>(aggregates_.of[i]);
    arms_[i] = centres_[i] - centres[p];
    sizes[p] = std::max(sizes[p], arms_[i].norm() + sizes_[i]);
  }
  for (std::size_t i = 0; i < centres_.size(); ++i) {
    const double size = sizes[static_cast<std::size_t>(aggregates_.of[i])];
    arms_[i] = size > 0 ? Vec3(arms_[i] / size) : Vec3::Zero();
    turns_[i] = size > 0 ? sizes_[i] / size : 0;
  }
}

// The motion (u, w) of the coarser aggregate moves this one by (u + w x arm, turn w). With
//   Q = [I, -[arm]x; 0, turn I]
// the coarser matrix is sum Q_i^T B_ij Q_j (Galerkin).
bool AggregateMatrix::prepare_coarser() {
  place_coarser();
  coarser_->clear();
  for (int i = 0; i < count(); ++i)
    for (int at = pattern_.begin[static_cast<std::size_t>(i)];
         at < pattern_.begin[static_cast<std::size_t>(i) + 1]; ++at) {
      const int place = place_in_coarser_[static_cast<std::size_t>(at)];
      if (place < 0) continue;
      const auto j = static_cast<std::size_t>(pattern_.to[static_cast<std::size_t>(at)]);
      const double* const b = block(at);
      double* const out = coarser_->block(place);
      const Vec3 arm = arms_[j], left = arms_[static_cast<std::size_t>(i)];
      const double turn = turns_[j], left_turn = turns_[static_cast<std::size_t>(i)];
      for (int column = 0; column < 6; ++column) {
        double y[6];  // B_ij times the column of Q_j
        if (column < 3) {
          std::copy_n(b + column * kRow, 6, y);
        } else {
          const int k = column - 3, next = (k + 1) % 3, after = (k + 2) % 3;
          // e_k x arm has two entries, at `next` and `after`.
          const double to_next = -arm[static_cast<std::size_t>(after)];
          const double to_after = arm[static_cast<std::size_t>(next)];
          for (int row = 0; row < 6; ++row)
            y[row] = to_next * b[next * kRow + row] + to_after * b[after * kRow + row] +
                     turn * b[column * kRow + row];
        }
        add_turned(left, left_turn, y, out + column * kRow);
      }
    }
  return coarser_->prepare();
}

bool AggregateMatrix::factorise() {
  std::size_t entry = 0;
  const std::span<double> values = factor_->values();
  // Copies the upper half column by column; its columns are rows of the mirrored blocks.
  for (int j = 0; j < count(); ++j)
    for (int column = 0; column < 6; ++column)
      for (int at = pattern_.begin[static_cast<std::size_t>(j)];
           at <= own_[static_cast<std::size_t>(j)]; ++at) {
        const bool diagonal = at == own_[static_cast<std::size_t>(j)];
        for (int row = 0; row <= (diagonal ? column : 5); ++row)
          values[entry++] = block(at)[row * kRow + column];
      }
  return factor_->factorise();
}

void AggregateMatrix::solve_directly(const double* r, double* x) {
  for (std::size_t i = 0; i < sizes_.size(); ++i) std::copy_n(r + i * kRow, 6, &direct_[6 * i]);
  factor_->solve(direct_);
  for (std::size_t i = 0; i < sizes_.size(); ++i) std::copy_n(&direct_[6 * i], 6, x + i * kRow);
}

void AggregateMatrix::smooth(const double* r, double* x, bool from_zero) {
  for (std::size_t step = 0; step < steps_.size(); ++step) {
    const bool zero = from_zero && step == 0;
    if (!zero) kernels_.residual(pattern_, narrow_.data(), r, x, rest_.data(), 0, count());
    kernels_.relax(inverses_.data(), steps_[step], zero ? r : rest_.data(), x, !zero, 0, count());
  }
}

// x += Q (about B_c^-1) Q^T (r - B x)
void AggregateMatrix::correct(const double* r, double* x) {
  kernels_.residual(pattern_, narrow_.data(), r, x, rest_.data(), 0, count());
  std::ranges::fill(r_.span(), 0.0);
  for (std::size_t i = 0; i < arms_.size(); ++i)
    add_turned(arms_[i], turns_[i], &rest_[i * kRow],
               &r_[static_cast<std::size_t>(aggregates_.of[i]) * kRow]);
  coarser_->solve(r_.data(), x_.data());
  if (coarser_->coarser_) {
    // The remaining residual is solved once more: a W-cycle.
    AggregateMatrix& c = *coarser_;
    c.kernels_.residual(c.pattern_, c.narrow_.data(), r_.data(), x_.data(), r_.data(), 0,
                        c.count());
    c.solve(r_.data(), again_.data());
    for (std::size_t i = 0; i < x_.size(); ++i) x_[i] += again_[i];
  }
  for (std::size_t i = 0; i < arms_.size(); ++i) {
    const double* const from = &x_[static_cast<std::size_t>(aggregates_.of[i]) * kRow];
    double* const to = x + i * kRow;
    const Vec3& arm = arms_[i];
    to[0] += from[0] + from[4] * arm[2] - from[5] * arm[1];
    to[1] += from[1] + from[5] * arm[0] - from[3] * arm[2];
    to[2] += from[2] + from[3] * arm[1] - from[4] * arm[0];
    for (int k = 3; k < 6; ++k) to[k] += turns_[i] * from[k];
  }
}

void AggregateMatrix::solve(const double* r, double* x) {
  if (!coarser_) return solve_directly(r, x);
  smooth(r, x, true);
  correct(r, x);
  smooth(r, x, false);
}

}  // namespace sim
