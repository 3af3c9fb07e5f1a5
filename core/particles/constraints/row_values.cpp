#include "core/particles/constraints/row_values.h"

#include <algorithm>
#include <cmath>

#include "core/base/assert.h"

namespace sim {

const RowList::Part& RowList::part_of(int row) const {
  SIM_ASSERT(0 <= row && row < rows());
  SIM_ASSERT(std::ranges::is_sorted(parts, {}, &Part::row));
  const auto after = std::ranges::upper_bound(parts, row, {}, &Part::row);
  return *(after - 1);
}

std::string RowList::name(int row) const {
  const Part& part = part_of(row);
  return part.constraint->name(row - part.row);
}

int RowList::end_of(std::size_t part) const {
  return part + 1 < parts.size() ? parts[part + 1].row : rows();
}

std::size_t RowList::pairs_of(int row) const {
  const std::size_t particles = pattern.of(row).size();
  return particles * (particles + 1) / 2;
}

std::size_t RowList::pairs() const {
  std::size_t pairs = 0;
  for (int r = 0; r < rows(); ++r) pairs += pairs_of(r);
  return pairs;
}

void RowList::write_curvature(ParticleView view, const double* memory,
                              std::span<double> pairs) const {
  std::ranges::fill(pairs, 0.0);
  double* next = pairs.data();
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Part& part = parts[p];
    view.internal = {memory + part.memory, part.internal_size};
    part.constraint->curvature(view, next);
    for (int r = part.row; r < end_of(p); ++r) next += pairs_of(r);
  }
}

RowValues::RowValues(const RowList& list) : list_(&list) { resize(); }

void RowValues::resize() {
  const auto rows = static_cast<std::size_t>(list_->rows());
  for (std::vector<double>* const values : {&phi_, &drive_, &bias_}) values->resize(rows);
  gradient_.resize(list_->pattern.ids.size());
}

bool RowValues::evaluate(ParticleView view, const double* memory) {
  resize();
  for (const RowList::Part& part : list_->parts) {
    view.internal = {memory + part.memory, part.internal_size};
    part.constraint->evaluate(view, {phi_.data() + part.row, gradient_.data() + part.entry,
                                     drive_.data() + part.row, bias_.data() + part.row});
  }
  double poison = 0;
  for (std::size_t r = 0; r < phi_.size(); ++r) poison += 0 * (phi_[r] + drive_[r] + bias_[r]);
  for (const Vec3& each : gradient_) poison += 0 * (each.x() + each.y() + each.z());
  return poison == 0;
}

double RowValues::largest_phi() const {
  double most = 0;
  for (const double phi : phi_) most = std::max(most, std::fabs(phi));
  return most;
}

double RowValues::driving_power(std::span<const double> multipliers,
                                const ParticleView& view) const {
  double power = 0;
  for (std::size_t r = 0; r < multipliers.size(); ++r) power -= multipliers[r] * drive_[r];
  const RowPattern& pattern = list_->pattern;
  for (std::size_t r = 0; r < multipliers.size(); ++r)
    for (auto e = static_cast<std::size_t>(pattern.begin[r]);
         e < static_cast<std::size_t>(pattern.begin[r + 1]); ++e)
      if (!view.free(pattern.ids[e]))
        power -= multipliers[r] * gradient_[e].dot(view.velocity(pattern.ids[e]));
  return power;
}

template <class Body>
void RowValues::for_parts(int n, const Body& body) const {
  constexpr int kWorthThreads = 512;  // rows, or parts of them
  if (pool_)
    pool_->run_if_many(n, kWorthThreads, body);
  else
    body(0, n);
}

void RowValues::times(const double* const v[3], double* out) const {
  const RowPattern& pattern = list_->pattern;
  for_parts(list_->rows(), [&](int begin, int end) {
    for (auto r = static_cast<std::size_t>(begin); r < static_cast<std::size_t>(end); ++r) {
      double sum = 0;
      for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
        const auto at = static_cast<std::size_t>(e);
        const int i = pattern.ids[at];
        const Vec3& g = gradient_[at];
        sum += g.x() * v[0][i] + g.y() * v[1][i] + g.z() * v[2][i];
      }
      out[r] = sum;
    }
  });
}

// Rows of different parts share no particle.
void RowValues::add_transposed(const double* lambda, const double* weights,
                               double* const v[3]) const {
  const RowPattern& pattern = list_->pattern;
  const std::vector<int>& cuts = list_->cuts;
  for_parts(static_cast<int>(cuts.size()) - 1, [&](int first, int last) {
    const auto end = static_cast<std::size_t>(cuts[static_cast<std::size_t>(last)]);
    for (auto r = static_cast<std::size_t>(cuts[static_cast<std::size_t>(first)]); r < end; ++r)
      for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
        const auto at = static_cast<std::size_t>(e);
        const int i = pattern.ids[at];
        const double s = weights[i] * lambda[r];
        v[0][i] += s * gradient_[at].x();
        v[1][i] += s * gradient_[at].y();
        v[2][i] += s * gradient_[at].z();
      }
  });
}

}  // namespace sim
