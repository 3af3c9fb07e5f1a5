#include "lattice.h"

#include <algorithm>

namespace sim {
namespace {

// Vectors of eight begin on a cache line and may end behind the last cell.
std::ptrdiff_t whole_vectors(int count) { return (std::ptrdiff_t{count} + 7) / 8 * 8; }

int modulo(int number, int by) { return (number % by + by) % by; }

}  // namespace

Lattice::Index Lattice::offset(std::span<const int> numbers) {
  Index all{};
  if (numbers.size() > 1) all[0] = numbers.front();
  if (numbers.size() > 2) all[1] = numbers[1];
  all[2] = numbers.back();
  return all;
}

Lattice::Lattice(int names, std::span<const int> cells, const Index& reach, LatticeEdge edge)
    : names_(names), extents_{1, 1, 1}, reach_(reach), edge_(std::move(edge)) {
  if (!cells.empty())
    for (std::size_t k = 0; k < 3; ++k) extents_[k] = std::max(offset(cells)[k], 1);
  lead_ = whole_vectors(reach[2]);
  pitch_ = lead_ + whole_vectors(length() + reach[2]);
  for (int i = 1; i <= reach[2]; ++i)
    for (const int to : {-i, length() - 1 + i}) ghosts_.emplace_back(to, folded(to, 2));
}

int Lattice::folded(int index, int direction) const {
  const int extent = extents_[static_cast<std::size_t>(direction)];
  if (index >= 0 && index < extent) return index;
  switch (edge_.kind) {
    case LatticeEdge::Kind::kPeriodic:
      return modulo(index, extent);
    case LatticeEdge::Kind::kMirror: {
      const int twice = modulo(index, 2 * extent);
      return twice < extent ? twice : 2 * extent - 1 - twice;
    }
    default:
      return -1;
  }
}

int Lattice::neighbour(int cell, const Index& offset) const {
  const Index at{cell / (extents_[1] * extents_[2]), cell / extents_[2] % extents_[1],
                 cell % extents_[2]};
  int result = 0;
  for (int d = 0; d < 3; ++d) {
    const auto k = static_cast<std::size_t>(d);
    const int index = folded(at[k] + offset[k], d);
    if (index < 0) return -1;
    result = result * extents_[k] + index;
  }
  return result;
}

void Lattice::load_row(const double* state, int slab, int row, double* to) const {
  const auto count = static_cast<std::size_t>(length()), names = static_cast<std::size_t>(names_);
  const double* const from = state + static_cast<std::size_t>(first_cell(slab, row)) * names;
  if (names == 1) {
    std::copy_n(from, count, to);
  } else if (names == 2) {
    kernels_.split(from, to, to + pitch_, count);
  } else {
    for (std::size_t name = 0; name < names; ++name, to += pitch_)
      for (std::size_t i = 0; i < count; ++i) to[i] = from[i * names + name];
  }
}

void Lattice::store_row(const double* from, int slab, int row, double* state) const {
  const auto count = static_cast<std::size_t>(length()), names = static_cast<std::size_t>(names_);
  double* const to = state + static_cast<std::size_t>(first_cell(slab, row)) * names;
  if (names == 1) {
    std::copy_n(from, count, to);
  } else if (names == 2) {
    kernels_.join(from, from + pitch_, to, count);
  } else {
    for (std::size_t name = 0; name < names; ++name, from += pitch_)
      for (std::size_t i = 0; i < count; ++i) to[i * names + name] = from[i];
  }
}

void Lattice::fill_ghosts(double* row) const {
  for (std::size_t name = 0; name < static_cast<std::size_t>(names_); ++name, row += pitch_)
    for (const auto& [to, from] : ghosts_) row[to] = from < 0 ? edge_.values[name] : row[from];
}

void Lattice::fill_with_edge(double* row) const {
  for (std::size_t name = 0; name < edge_.values.size(); ++name)
    std::fill_n(row - lead_ + static_cast<std::ptrdiff_t>(name) * pitch_, pitch_,
                edge_.values[name]);
}

LatticeRows::LatticeRows(const Lattice& lattice, int names, int kept, int margin)
    : margin_(margin), reach_(lattice.reach()[1]) {
  const std::ptrdiff_t row = lattice.pitch() * names, slab = row * lattice.rows();
  const bool goes_on = lattice.edge() == LatticeEdge::Kind::kPeriodic && kept < lattice.slabs();
  for (int i = -margin; i < lattice.slabs() + margin; ++i) {
    const int at = goes_on ? i : lattice.folded(i, 0);
    slabs_.push_back(at < 0 && !goes_on ? -1 : lattice.lead() + slab * modulo(at, kept));
  }
  for (int j = -reach_; j < lattice.rows() + reach_; ++j) {
    const int at = lattice.folded(j, 1);
    rows_.push_back(at < 0 ? -1 : row * at);
  }
  const bool has_edge = names == lattice.names();
  numbers_ = Array(static_cast<std::size_t>(slab * kept + (has_edge ? row : 0)));
  edge_ = slab * kept + lattice.lead();
  if (has_edge) lattice.fill_with_edge(numbers_.data() + edge_);
}

void LatticeRows::load(const Lattice& lattice, const double* state) {
  for (int i = 0; i < lattice.slabs(); ++i)
    for (int j = 0; j < lattice.rows(); ++j) {
      lattice.load_row(state, i, j, row(i, j));
      lattice.fill_ghosts(row(i, j));
    }
}

void LatticeRows::store(const Lattice& lattice, double* state) {
  for (int i = 0; i < lattice.slabs(); ++i)
    for (int j = 0; j < lattice.rows(); ++j) lattice.store_row(row(i, j), i, j, state);
}

}  // namespace sim
