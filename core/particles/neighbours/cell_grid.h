// Points sorted into the cells of a grid, for the search of neighbours.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/particles/view.h"

namespace sim {

// Cubic cells fill space and are folded onto a grid with some two cells a point at most: cell (x,
// y, z) is number (x mod A) + A ((y mod B) + B (z mod C)). Far outliers therefore take no memory;
// they share cells with others. Cells around the median of the points come first, and points very
// far from it count as nearer: points less than a width apart stay in the same or neighbouring
// cells.
class CellGrid {
 public:
  // Sorts the points of a view into cells `width` wide (m). A point that is not finite may be in
  // any cell.
  void sort(const ParticleView& view, double width);

  // Ids by cell, ascending within each. A place is an index into this.
  std::span<const std::int32_t> order() const { return order_; }
  int cell_at(int place) const { return cells_[static_cast<std::size_t>(place)]; }

  // Places [begin, end) in all cells at and around one; each place is in at most one row.
  struct Row {
    int begin, end;
  };
  struct Rows {
    Row at[18];
    int count;
  };
  Rows around(int cell) const;

 private:
  int size_[3] = {};                          // A, B, C: at least 3 each
  std::vector<std::int32_t> starts_;          // of each cell among the places
  std::vector<std::int32_t> order_, cells_;   // id and cell of each place
  std::vector<std::int32_t> cell_of_, next_;  // scratch: cell of each id; where its next one goes
  std::vector<double> coordinates_[3], sample_;  // scratch: of each id, in cells
};

}  // namespace sim
