#include "row_curvature.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace sim {
RowCurvature::RowCurvature(const RowList& list, int particles)
    : list_(&list),
      multiples_(list.pairs()),
      blocks_(list.pairs()),
      moved_(3 * static_cast<std::size_t>(particles)) {
  std::size_t pair = 0;
  int most = 0, most_entries = 0;
  for (std::size_t p = 0; p < list.parts.size(); ++p) {
    const int begin = list.parts[p].row, end = list.end_of(p);
    Part& part = parts_.emplace_back(Part{p, pair, 0, end - begin, {}});
    for (int r = begin; r < end; ++r) part.pairs += list.pairs_of(r);
    pair += part.pairs;
    most = std::max(most, end - begin);
    most_entries = std::max(most_entries, list.pattern.begin[static_cast<std::size_t>(end)] -
                                              list.pattern.begin[static_cast<std::size_t>(begin)]);
  }
  numbers_.resize(3 * static_cast<std::size_t>(most));
  for (auto& each : gradient_) each.resize(static_cast<std::size_t>(most_entries));
}

// Greedy colouring: each particle joins the first group in which no particle shares a row with it.
void RowCurvature::make_groups(Part& part) const {
  const int begin = list_->parts[part.part].row;
  std::vector<std::vector<std::uint8_t>> taken;  // of a group: the rows with a particle of it
  const RowPattern& pattern = list_->pattern;
  std::vector<std::pair<int, int>> rows_of;  // particle, row
  for (int r = begin; r < begin + part.rows; ++r)
    for (const int i : pattern.of(r)) rows_of.emplace_back(i, r - begin);
  std::ranges::sort(rows_of);
  for (auto first = rows_of.begin(); first != rows_of.end();) {
    const auto last = std::find_if(first, rows_of.end(),
                                   [&](const auto& each) { return each.first != first->first; });
    const auto free = std::ranges::find_if(taken, [&](const auto& rows) {
      return std::none_of(first, last, [&](const auto& each) {
        return rows[static_cast<std::size_t>(each.second)] != 0;
      });
    });
    const auto group = static_cast<std::size_t>(free - taken.begin());
    if (free == taken.end()) {
      taken.emplace_back(static_cast<std::size_t>(part.rows));
      part.groups.emplace_back();
    }
    part.groups[group].push_back(first->first);
    for (; first != last; ++first) taken[group][static_cast<std::size_t>(first->second)] = 1;
  }
}

void RowCurvature::evaluate(const ParticleView& view, const double* memory) {
  list_->write_curvature(view, memory, multiples_);
  for (std::size_t k = 0; k < blocks_.size(); ++k)
    blocks_[k] = Mat3::Diagonal({multiples_[k], multiples_[k], multiples_[k]});
  for (Part& part : parts_) {
    const auto own = std::span(multiples_).subspan(part.first_pair, part.pairs);
    if (std::ranges::any_of(own, [](double each) { return each != 0; })) continue;
    if (part.groups.empty()) make_groups(part);
    add_differences(part, view, memory);
  }
}

void RowCurvature::add_differences(const Part& part, const ParticleView& view,
                                   const double* memory) {
  const RowList::Part& own = list_->parts[part.part];
  const RowPattern& pattern = list_->pattern;
  const auto n = static_cast<std::size_t>(view.n);
  double* const axes[3] = {moved_.data(), moved_.data() + n, moved_.data() + 2 * n};
  const double* const from[3] = {view.x, view.y, view.z};
  double size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::copy_n(from[axis], n, axes[axis]);
    for (std::size_t i = 0; i < n; ++i) size = std::max(size, std::fabs(from[axis][i]));
  }
  ParticleView moved = view;
  moved.x = axes[0], moved.y = axes[1], moved.z = axes[2];
  moved.internal = {memory + own.memory, own.internal_size};
  const double h = 6e-6 * (size > 0 ? size : 1);  // the cube root of a rounding
  const auto rows = static_cast<std::size_t>(part.rows);
  const auto first_entry = pattern.begin[static_cast<std::size_t>(own.row)];
  for (const std::vector<int>& group : part.groups)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int side : {0, 1}) {
        for (const int i : group) axes[axis][i] = from[axis][i] + (side == 0 ? h : -h);
        own.constraint->evaluate(moved, {numbers_.data(), gradient_[side].data(),
                                         numbers_.data() + rows, numbers_.data() + 2 * rows});
      }
      for (const int i : group) axes[axis][i] = from[axis][i];
      // Column `axis` of the curvature blocks of each row with respect to its particle in this
      // group.
      std::size_t pair = part.first_pair;
      for (int r = own.row; r < own.row + part.rows; ++r) {
        const std::span<const int> ids = pattern.of(r);
        const auto entry =
            static_cast<std::size_t>(pattern.begin[static_cast<std::size_t>(r)] - first_entry);
        for (std::size_t a = 0; a < ids.size(); ++a)
          for (std::size_t b = a; b < ids.size(); ++b, ++pair) {
            // Blocks off the diagonal are computed from both sides and averaged.
            const double share = a == b ? 1 : 0.5;
            const auto slope = [&](std::size_t k) {
              return share / (2 * h) * (gradient_[0][entry + k] - gradient_[1][entry + k]);
            };
            if (std::ranges::binary_search(group, ids[b]))
              for (std::size_t row = 0; row < 3; ++row) blocks_[pair](row, axis) += slope(a)[row];
            if (a != b && std::ranges::binary_search(group, ids[a]))
              for (std::size_t row = 0; row < 3; ++row) blocks_[pair](axis, row) += slope(b)[row];
          }
      }
    }
  for (std::size_t k = part.first_pair, r = 0; r < rows; ++r) {
    const std::size_t count = pattern.of(own.row + static_cast<int>(r)).size();
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = a; b < count; ++b, ++k)
        if (a == b) blocks_[k] = 0.5 * (blocks_[k] + transposed(blocks_[k]));
  }
}

}  // namespace sim
