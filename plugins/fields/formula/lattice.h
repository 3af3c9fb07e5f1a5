// A lattice of cells, its numbers row by row, and what lies beyond its ends.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <utility>
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
// runs fastest. Cells (i, j, ...) are a row, rows (i, ...) a slab; what has one direction is a row,
// what has two is slabs of one row. A row in memory has all cells of name 0, then of name 1, ...,
// each on its own cache line with ghost cells before and behind, so that neighbours within the row
// are a fixed number of places away and vectors of cells are contiguous.
class Lattice {
 public:
  using Index = std::array<int, 3>;

  Lattice() = default;
  // cells: their numbers in one to three directions; reach: how far neighbours are, as an offset.
  Lattice(int names, std::span<const int> cells, const Index& reach, LatticeEdge edge);

  // An offset in as many directions as there are cells in, as slab, row and cell.
  static Index offset(std::span<const int> numbers);

  int names() const { return names_; }
  int cells() const { return extents_[0] * extents_[1] * extents_[2]; }
  int slabs() const { return extents_[0]; }
  int rows() const { return extents_[1]; }  // of a slab
  int length() const { return extents_[2]; }
  const Index& reach() const { return reach_; }
  LatticeEdge::Kind edge() const { return edge_.kind; }

  // The numbers from a name of a row to the next; before the first cell; of a row in all.
  std::ptrdiff_t pitch() const { return pitch_; }
  std::ptrdiff_t lead() const { return lead_; }
  int first_cell(int slab, int row) const { return (slab * extents_[1] + row) * extents_[2]; }

  // The cells of a row of a state.
  void load_row(const double* state, int slab, int row, double* to) const;
  void store_row(const double* from, int slab, int row, double* state) const;
  // The ghosts of a row whose cells are known.
  void fill_ghosts(double* row) const;
  void fill_with_edge(double* row) const;  // all of it

  // An index folded into the lattice; -1 beyond the ends where those have values.
  int folded(int index, int direction) const;
  // The cell that many away from another one, or -1.
  int neighbour(int cell, const Index& offset) const;

 private:
  int names_ = 0;
  Index extents_ = {}, reach_ = {};
  LatticeEdge edge_;
  std::ptrdiff_t lead_ = 0, pitch_ = 0;
  std::vector<std::pair<int, int>> ghosts_;  // {to, from} of a row; -1: the value of the edge
  LatticeKernels kernels_ = lattice_kernels();
};

// Rows of a lattice: of all its slabs, or of those written last.
class LatticeRows {
 public:
  LatticeRows() = default;
  // names: of each cell; kept: slabs in memory, the one of i where that of i - kept was; margin:
  // slabs that can be asked for beyond the ends.
  LatticeRows(const Lattice& lattice, int names, int kept, int margin);

  // The rows of a state, if all slabs are kept.
  void load(const Lattice& lattice, const double* state);
  void store(const Lattice& lattice, double* state);

  // The first cell of a row. Rows beyond the ends are those that the edge makes of them; a periodic
  // lattice of which not all slabs are kept goes on there.
  double* row(int slab, int row) {
    const std::ptrdiff_t a = slabs_[static_cast<std::size_t>(slab + margin_)],
                         b = rows_[static_cast<std::size_t>(row + reach_)];
    return numbers_.data() + (a < 0 || b < 0 ? edge_ : a + b);
  }

 private:
  int margin_ = 0, reach_ = 0;
  std::vector<std::ptrdiff_t> slabs_,
      rows_;                 // their places, from the first margin on; -1: the edge
  std::ptrdiff_t edge_ = 0;  // a row with its values
  Array numbers_;
};

}  // namespace sim
