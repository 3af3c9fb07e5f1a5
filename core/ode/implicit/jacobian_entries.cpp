#include "core/ode/implicit/jacobian_entries.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/array.h"
#include "core/base/finite.h"
#include "core/base/noise.h"
#include "core/base/slot.h"
#include "core/ode/jacobian_effort.h"
#include "core/ode/ode_system.h"

namespace sim {
namespace {

class Differences final : public JacobianEntries {
 public:
  Differences(OdeSystem& system, double t, const double* x) : system_(&system) {
    for (Array* array : {&point_, &f_, &moved_, &scratch_}) *array = Array(system.size());
    steps_.resize(system.size());
    colors_.resize(system.size());
    take(find(t, x));
  }

  const Sparsity& sparsity() const override { return sparsity_; }
  std::int64_t evaluations() const override { return evaluations_; }

  void at(double t, const double* x, std::span<double> values) override {
    constexpr double kRootOfPrecision = 1.5e-8, kSmall = 1e-4, kLeast = 1e-10;
    const double most = largest(x);
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const double size = std::max({std::fabs(x[i]), kSmall * most, kLeast});
      steps_[i] = (x[i] + kRootOfPrecision * size) - x[i];  // the exact change of x
    }
    evaluate(t, x, f_);
    for (int color = 0; color < count_; ++color) {
      for (std::size_t i = 0; i < steps_.size(); ++i)
        point_[i] = x[i] + (colors_[i] == color ? steps_[i] : 0);
      evaluate(t, point_.data(), moved_);
      for (int column = 0; column < sparsity_.size(); ++column) {
        if (colors_[slot(column)] != color) continue;
        for (int k = sparsity_.begin_of(column); k < sparsity_.end_of(column); ++k) {
          const std::size_t row = slot(sparsity_.row(k));
          values[slot(k)] = (moved_[row] - f_[row]) / steps_[slot(column)];
        }
      }
    }
  }

  bool look_again(double t, const double* x) override {
    const std::size_t before = sparsity_.count();
    std::vector<std::pair<int, int>> entries = find(t, x);
    for (int column = 0; column < sparsity_.size(); ++column)
      for (int k = sparsity_.begin_of(column); k < sparsity_.end_of(column); ++k)
        entries.emplace_back(column, sparsity_.row(k));
    take(std::move(entries));
    return sparsity_.count() != before;
  }

 private:
  // Columns begin <= j < end, and all rows that depend on them.
  struct Group {
    int begin, end;
    std::vector<int> rows;
  };

  double largest(const double* x) const { return largest(x, steps_.size()); }
  static double largest(const double* x, std::size_t size) {
    double most = 0;
    for (std::size_t i = 0; i < size; ++i) most = std::max(most, std::fabs(x[i]));
    return most;
  }

  void evaluate(double t, const double* x, Array& f) {
    system_->eval(t, {x, {}}, scratch_.data(), f.data());
    ++evaluations_;
  }

  void take(std::vector<std::pair<int, int>> entries) {
    sparsity_ = Sparsity(static_cast<int>(steps_.size()), std::move(entries));
    count_ = color_columns(sparsity_, colors_);
  }

  // {column, row} of all entries, found near x but not at it, so that no product is 0 by chance.
  std::vector<std::pair<int, int>> find(double t, const double* x) {
    constexpr double kNear = 1e-3, kSmall = 1e-2, kLeast = 1e-6;
    const int size = static_cast<int>(steps_.size());
    Noise noise;
    std::vector<double> center(x, x + size);
    const double most = largest(x);
    for (double& number : center) {
      const double scale = std::max({std::fabs(number), kSmall * most, kLeast});
      number += kNear * scale * noise.next();
    }
    evaluate(t, center.data(), f_);
    if (!all_finite(f_.span())) {
      center.assign(x, x + size);
      evaluate(t, center.data(), f_);
    }
    // The columns change by unrelated amounts.
    std::vector<double> change(slot(size));
    for (std::size_t i = 0; i < change.size(); ++i) {
      const double scale = std::max({std::fabs(center[i]), kSmall * most, kLeast});
      change[i] = kNear * scale * (1.5 + noise.next());
    }

    std::vector<Group> groups{{0, size, {}}};
    for (int row = 0; row < size; ++row) groups[0].rows.push_back(row);
    std::vector<std::pair<int, int>> entries;
    if (size == 1) return {{0, 0}};
    while (!groups.empty()) groups = halved(t, center, change, groups, entries);
    return entries;
  }

  // Halves all groups that some row depends on; groups of one column are entries.
  std::vector<Group> halved(double t, const std::vector<double>& center,
                            const std::vector<double>& change, const std::vector<Group>& groups,
                            std::vector<std::pair<int, int>>& entries) {
    std::vector<Group> next;
    std::vector<bool> done(groups.size(), false), taken(center.size(), false);
    for (std::size_t first = 0; first < groups.size(); ++first) {
      if (done[first]) continue;
      // Groups that share no row are changed together.
      taken.assign(taken.size(), false);
      std::vector<std::size_t> together;
      for (std::size_t g = first; g < groups.size(); ++g) {
        const std::vector<int>& rows = groups[g].rows;
        if (done[g] || std::ranges::any_of(rows, [&](int row) { return taken[slot(row)]; }))
          continue;
        for (const int row : rows) taken[slot(row)] = true;
        together.push_back(g);
        done[g] = true;
      }
      for (const bool upper : {false, true}) {
        std::ranges::copy(center, point_.data());
        for (const std::size_t g : together) {
          const int middle = (groups[g].begin + groups[g].end) / 2;
          const int begin = upper ? middle : groups[g].begin, end = upper ? groups[g].end : middle;
          for (int i = begin; i < end; ++i) point_[slot(i)] += change[slot(i)];
        }
        evaluate(t, point_.data(), moved_);
        for (const std::size_t g : together) {
          const int middle = (groups[g].begin + groups[g].end) / 2;
          Group half{upper ? middle : groups[g].begin, upper ? groups[g].end : middle, {}};
          for (const int row : groups[g].rows)
            if (!(moved_[slot(row)] == f_[slot(row)])) half.rows.push_back(row);
          if (half.rows.empty()) continue;
          if (half.end - half.begin > 1)
            next.push_back(std::move(half));
          else
            for (const int row : half.rows) entries.emplace_back(half.begin, row);
        }
      }
    }
    return next;
  }

  OdeSystem* system_;
  Sparsity sparsity_;
  std::vector<int> colors_;
  int count_ = 0;
  Array point_, f_, moved_, scratch_;
  std::vector<double> steps_;
  std::int64_t evaluations_ = 0;
};

class AllEntries final : public JacobianEntries {
 public:
  explicit AllEntries(OdeSystem& system) : jacobian_(system.jacobian()), columns_(system.shape()) {
    std::vector<std::pair<int, int>> entries;
    for (const std::size_t column : columns_.places())
      for (const std::size_t row : columns_.places())
        entries.emplace_back(static_cast<int>(column), static_cast<int>(row));
    sparsity_ = Sparsity(static_cast<int>(system.size()), std::move(entries));
  }

  const Sparsity& sparsity() const override { return sparsity_; }

  void at(double t, const double* x, std::span<double> values) override {
    jacobian_->at(t, x);
    columns_.write(*jacobian_, values);
  }

  std::int64_t evaluations() const override { return evaluations_of(*jacobian_); }

 private:
  std::unique_ptr<Jacobian> jacobian_;
  JacobianColumns columns_;
  Sparsity sparsity_;
};

}  // namespace

int color_columns(const Sparsity& sparsity, std::span<int> colors) {
  int count = 0;
  std::vector<std::vector<int>> columns(static_cast<std::size_t>(sparsity.size()));  // of each row
  std::vector<int> last;  // column that may not have this color
  for (int column = 0; column < sparsity.size(); ++column) {
    for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
      for (const int other : columns[slot(sparsity.row(k))])
        last[slot(colors[slot(other)])] = column;
    int color = 0;
    while (color < count && last[slot(color)] == column) ++color;
    if (color == count) {
      ++count;
      last.push_back(-1);
    }
    colors[slot(column)] = color;
    for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
      columns[slot(sparsity.row(k))].push_back(column);
  }
  return count;
}

JacobianColumns::JacobianColumns(const StateShape& shape)
    : places_(shape.places()), unit_(shape.size()), column_(shape.size()) {}

void JacobianColumns::write(Jacobian& jacobian, std::span<double> values) {
  auto next = values.begin();
  for (const std::size_t place : places_) {
    unit_[place] = 1;
    jacobian.apply(unit_.data(), column_.data());
    unit_[place] = 0;
    for (const std::size_t row : places_) *next++ = column_[row];
  }
}

std::unique_ptr<JacobianEntries> all_entries(OdeSystem& system) {
  return std::make_unique<AllEntries>(system);
}

std::unique_ptr<JacobianEntries> difference_entries(OdeSystem& system, double t, const double* x) {
  return std::make_unique<Differences>(system, t, x);
}

}  // namespace sim
