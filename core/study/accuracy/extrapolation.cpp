#include "core/study/accuracy/extrapolation.h"

#include <algorithm>
#include <cmath>

namespace sim::study {
namespace {

constexpr double kAgreement = 4e-15;  // of the size of the numbers, in a step
constexpr double kLeast = 1e-8;       // size of a number, of the largest of all
constexpr double kSmallest = 1e-12;   // step, of the remaining time

}  // namespace

Extrapolation::Extrapolation(OdeSystem& system, const double* x, std::int64_t most_evaluations)
    : system_(&system), most_(most_evaluations) {
  const std::size_t n = system.size();
  for (Array* array : {&x_, &carry_, &rate0_, &rate_, &y_, &older_, &newer_, &row_})
    *array = Array(n);
  for (int i = 0; i < kColumns; ++i) table_.emplace_back(n);
  std::copy(x, x + n, x_.data());
  // Coordinates are scaled by the largest of their kind, numbers of a flat state one by one.
  const StateShape shape = system.shape();
  for (const StatePart& part : shape.parts()) {
    const bool alone = part.components.size() == 1;
    const auto first = groups_.size();
    for (std::size_t i = 0; i < part.count; ++i)
      for (std::size_t c = 0; c < part.components.size(); ++c) {
        const std::size_t at = part.at(i, c);
        groups_.emplace_back(at, alone ? groups_.size() : first);
      }
  }
  scale_.assign(groups_.size(), 0.0);
}

void Extrapolation::eval(double t, const Array* increment, Array& rate) {
  ++evaluations_;
  const Stage::Term term{1, increment ? increment->data() : nullptr};
  const Stage stage{x_.data(), {&term, increment ? std::size_t{1} : std::size_t{0}}};
  system_->eval(t, stage, y_.data(), rate.data());
}

// d_1 = h f(x), d_(m+1) = d_(m-1) + 2 h f(x + d_m), and at the end the mean of the two neighbours
// that leaves only even powers of h in the error (Gragg 1965).
void Extrapolation::midpoint(double big_h, int substeps, Array& increment) {
  const double h = big_h / substeps;
  const std::size_t n = x_.size();
  std::fill_n(older_.data(), n, 0.0);
  for (std::size_t i = 0; i < n; ++i) newer_[i] = h * rate0_[i];
  for (int m = 1; m < substeps; ++m) {
    eval(t_ + m * h, &newer_, rate_);
    for (std::size_t i = 0; i < n; ++i) older_[i] += 2 * h * rate_[i];
    std::swap(older_, newer_);
  }
  eval(t_ + big_h, &newer_, rate_);
  for (std::size_t i = 0; i < n; ++i) increment[i] = 0.5 * (newer_[i] + older_[i] + h * rate_[i]);
}

bool Extrapolation::converged(const Array& increment, const Array& coarser) {
  now_ = scale_;
  for (const auto& [at, group] : groups_)
    now_[group] = std::max(now_[group], std::abs(increment[at]));
  const double least = kLeast * *std::ranges::max_element(now_);
  return std::ranges::all_of(groups_, [&](const auto& number) {
    const auto [at, group] = number;
    const double scale = std::max(now_[group], least);
    return std::abs(increment[at] - coarser[at]) <= kAgreement * scale;
  });
}

// Compensated summation: the rounding error is carried to the next sum (Kahan 1965).
void Extrapolation::add(const Array& increment) {
  for (std::size_t i = 0; i < x_.size(); ++i) {
    const double rest = increment[i] - carry_[i];
    const double sum = x_[i] + rest;
    carry_[i] = (sum - x_[i]) - rest;
    x_[i] = sum;
  }
}

// Rows of Neville's scheme in h^2 with 2, 4, 6, ... substeps, until two of its corners agree.
int Extrapolation::step(double h) {
  for (const auto& [at, group] : groups_) scale_[group] = std::max(scale_[group], std::abs(x_[at]));
  eval(t_, nullptr, rate0_);
  Array& row = row_;
  for (int j = 0; j < kColumns; ++j) {
    midpoint(h, 2 * (j + 1), row);
    // table_[k] holds T(j-1, k); row becomes T(j, 0), T(j, 1), ...
    for (int k = 0; k < j; ++k) {
      const double ratio = static_cast<double>(j + 1) / (j - k);
      const double factor = 1 / (ratio * ratio - 1);
      Array& above = table_[static_cast<std::size_t>(k)];
      for (std::size_t i = 0; i < row.size(); ++i) {
        const double finer = row[i] + factor * (row[i] - above[i]);
        above[i] = row[i];
        row[i] = finer;
      }
    }
    const bool good = j > 1 && converged(row, table_[static_cast<std::size_t>(j - 1)]);
    if (good) {
      add(row);
      return j + 1;
    }
    std::swap(table_[static_cast<std::size_t>(j)], row);
  }
  return 0;
}

bool Extrapolation::advance(double end, const std::function<bool()>& go_on) {
  const double whole = end - t_;
  if (!(h_ > 0)) h_ = whole;
  while (t_ < end) {
    if (evaluations_ > most_ || !go_on()) return false;
    const double left = end - t_;
    const bool last = h_ >= left * (1 - 1e-9);
    const double h = last ? left : h_;
    const int columns = step(h);
    if (columns == 0) {
      h_ = h / 2;
      if (h_ < kSmallest * whole) return false;
      continue;
    }
    t_ = last ? end : t_ + h;
    if (columns <= kColumns - 3) h_ = std::max(h_, 2 * h);
  }
  return std::all_of(groups_.begin(), groups_.end(),
                     [&](const auto& group) { return std::isfinite(x_[group.first]); });
}

}  // namespace sim::study
