// The numbers of a lattice of cells, an array for each name, with neighbours at fixed distances.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/base/array.h"

namespace sim {

// Pairs of numbers that alternate, taken apart and put together.
struct LatticeKernels {
  void (*split)(const double* pairs, double* first, double* second, std::size_t count);
  void (*join)(const double* first, const double* second, double* pairs, std::size_t count);
};
LatticeKernels lattice_kernels();

// The boundary values beyond the ends of a lattice.
struct LatticeEdge {
  // kMirror: the cells in reverse order, the first one again first, so that nothing flows out.
  enum class Kind { kValues, kPeriodic, kMirror } kind = Kind::kValues;
  std::vector<double> values;  // one a name
};

// A flat state holds all names of cell 0, then of cell 1, ...; of cells (i, j, k) the last number
// runs fastest. Here each name has an array of its own, with ghost cells around it, so that a
// neighbour is a fixed number of places away and vectors of cells are contiguous.
class Lattice {
 public:
  using Index = std::array<int, 3>;

  Lattice() = default;
  // `extents`: cells in each direction, 1 where there is none; `reach`: how far neighbours are.
  Lattice(int names, const Index& extents, const Index& reach, LatticeEdge edge);

  int names() const { return names_; }
  int cells() const { return extents_[0] * extents_[1] * extents_[2]; }

  // Takes the numbers of a state.
  void load(const double* state);

  // The array of a name; cells lie at first() <= index < end(), with ghost cells between. Readable
  // 8 entries further.
  const double* array(int name) const { return arrays_[static_cast<std::size_t>(name)].data(); }
  std::ptrdiff_t first() const { return place_of({0, 0, 0}); }
  std::ptrdiff_t end() const {
    return place_of({extents_[0] - 1, extents_[1] - 1, extents_[2] - 1}) + 1;
  }
  std::ptrdiff_t distance(const Index& offset) const {
    return (offset[0] * std::ptrdiff_t{pitch_[0]} + offset[1]) * pitch_[1] + offset[2];
  }

  // state[...] := values[name][i] for the places begin + i of cells, i < count.
  void store(const double* const* values, std::ptrdiff_t begin, int count, double* state) const;

  std::ptrdiff_t place(int cell) const { return place_of(index_of(cell)); }
  // The cell that many away from another one, or -1 beyond the ends where those have values.
  int neighbour(int cell, const Index& offset) const;

 private:
  Index index_of(int cell) const {
    return {cell / (extents_[1] * extents_[2]), cell / extents_[2] % extents_[1],
            cell % extents_[2]};
  }
  std::ptrdiff_t place_of(const Index& cell) const;
  int folded(int index, int direction) const;  // into the lattice; -1: it is not

  // Ghost cells that are contiguous, and so are the cells they repeat.
  struct Run {
    std::ptrdiff_t to, from;
    std::size_t count;
  };
  struct Row {
    std::ptrdiff_t place;
    int cell;  // the first one
  };

  int names_ = 0;
  Index extents_ = {}, reach_ = {};
  std::array<int, 2> pitch_ = {};  // rows with ghosts in a plane, places in a row
  LatticeEdge edge_;
  std::vector<Array> arrays_;
  std::vector<Run> runs_;
  std::vector<Row> rows_;  // of cells, ascending
  LatticeKernels kernels_ = lattice_kernels();
};

}  // namespace sim
