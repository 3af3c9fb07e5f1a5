#include "lattice.h"

#include <algorithm>
#include <utility>

namespace sim {

Lattice::Lattice(int names, const Index& extents, const Index& reach, LatticeEdge edge)
    : names_(names), extents_(extents), reach_(reach), edge_(std::move(edge)) {
  constexpr std::size_t kBehind = 8;  // places that vectors may read
  pitch_ = {extents[1] + 2 * reach[1], extents[2] + 2 * reach[2]};
  const auto places = static_cast<std::size_t>(extents[0] + 2 * reach[0]) *
                      static_cast<std::size_t>(pitch_[0]) * static_cast<std::size_t>(pitch_[1]);
  for (int name = 0; name < names; ++name) {
    Array& array = arrays_.emplace_back(places + kBehind);
    if (edge_.kind == LatticeEdge::Kind::kValues && !edge_.values.empty())
      std::fill_n(array.data(), places, edge_.values[static_cast<std::size_t>(name)]);
  }
  int cell = 0;
  for (int i = 0; i < extents[0]; ++i)
    for (int j = 0; j < extents[1]; ++j, cell += extents[2])
      rows_.push_back({place_of({i, j, 0}), cell});
  if (edge_.kind == LatticeEdge::Kind::kValues) return;

  for (int i = -reach[0]; i < extents[0] + reach[0]; ++i)
    for (int j = -reach[1]; j < extents[1] + reach[1]; ++j)
      for (int k = -reach[2]; k < extents[2] + reach[2]; ++k) {
        const Index from{folded(i, 0), folded(j, 1), folded(k, 2)};
        if (from == Index{i, j, k}) continue;
        const std::ptrdiff_t to = place_of({i, j, k}), source = place_of(from);
        if (!runs_.empty()) {
          Run& last = runs_.back();
          const auto count = static_cast<std::ptrdiff_t>(last.count);
          if (last.to + count == to && last.from + count == source) {
            ++last.count;
            continue;
          }
        }
        runs_.push_back({to, source, 1});
      }
}

std::ptrdiff_t Lattice::place_of(const Index& cell) const {
  return distance({cell[0] + reach_[0], cell[1] + reach_[1], cell[2] + reach_[2]});
}

int Lattice::folded(int index, int direction) const {
  const int extent = extents_[static_cast<std::size_t>(direction)];
  if (index >= 0 && index < extent) return index;
  switch (edge_.kind) {
    case LatticeEdge::Kind::kPeriodic:
      return (index % extent + extent) % extent;
    case LatticeEdge::Kind::kMirror: {
      const int twice = (index % (2 * extent) + 2 * extent) % (2 * extent);
      return twice < extent ? twice : 2 * extent - 1 - twice;
    }
    default:
      return -1;
  }
}

int Lattice::neighbour(int cell, const Index& offset) const {
  const Index at = index_of(cell);
  int result = 0;
  for (int d = 0; d < 3; ++d) {
    const auto k = static_cast<std::size_t>(d);
    const int index = folded(at[k] + offset[k], d);
    if (index < 0) return -1;
    result = result * extents_[k] + index;
  }
  return result;
}

void Lattice::load(const double* state) {
  const auto length = static_cast<std::size_t>(extents_[2]);
  const auto names = static_cast<std::size_t>(names_);
  for (const Row& row : rows_) {
    const double* const from = state + static_cast<std::size_t>(row.cell) * names;
    if (names == 1) {
      std::copy_n(from, length, arrays_[0].data() + row.place);
    } else if (names == 2) {
      kernels_.split(from, arrays_[0].data() + row.place, arrays_[1].data() + row.place, length);
    } else {
      for (std::size_t name = 0; name < names; ++name) {
        double* const to = arrays_[name].data() + row.place;
        for (std::size_t i = 0; i < length; ++i) to[i] = from[i * names + name];
      }
    }
  }
  for (Array& array : arrays_)
    for (const Run& run : runs_)
      std::copy_n(array.data() + run.from, run.count, array.data() + run.to);
}

void Lattice::store(const double* const* values, std::ptrdiff_t begin, int count,
                    double* state) const {
  const auto names = static_cast<std::size_t>(names_);
  const std::ptrdiff_t end = begin + count;
  auto row = std::ranges::upper_bound(rows_, begin, {}, &Row::place);
  if (row != rows_.begin()) --row;
  for (; row != rows_.end() && row->place < end; ++row) {
    const std::ptrdiff_t first = std::max(begin, row->place);
    const std::ptrdiff_t last = std::min(end, row->place + extents_[2]);
    if (last <= first) continue;
    const auto length = static_cast<std::size_t>(last - first);
    const std::ptrdiff_t cell = row->cell + (first - row->place), from = first - begin;
    double* const to = state + static_cast<std::size_t>(cell) * names;
    if (names == 1) {
      std::copy_n(values[0] + from, length, to);
    } else if (names == 2) {
      kernels_.join(values[0] + from, values[1] + from, to, length);
    } else {
      for (std::size_t name = 0; name < names; ++name)
        for (std::size_t i = 0; i < length; ++i)
          to[i * names + name] = values[name][from + static_cast<std::ptrdiff_t>(i)];
    }
  }
}

}  // namespace sim
