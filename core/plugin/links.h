// Ties between pairs of particles as a scene lists them: one by one, or as offsets over a grid.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "core/plugin/params.h"

namespace sim {

// a != b are particle ids. nan = not said: stiffness and damping then come from the force's
// parameters of these names, rest length from its `rest`, or else from the distance at the start.
struct LinkSpec {
  int a = 0, b = 0;
  double stiffness = std::nan(""), rest = std::nan(""), damping = std::nan("");
};

// The same tie at every place of a grid where both ends exist: (i, j) to (i + di, j + dj), where
// particle (i, j) has the id first + i * cols + j. rest is the distance of the offset in the grid.
struct GridLinks {
  int first = 0, rows = 0, cols = 0;
  int di = 0, dj = 0;
  double rest = std::nan("");
};

struct Links {
  std::vector<GridLinks> grids;
  std::vector<LinkSpec> ties;

  bool empty() const { return grids.empty() && ties.empty(); }
  std::size_t count() const;

  // Calls visit(link, natural) for every link, grids first, in a fixed order; natural is the rest
  // length that the grid implies, nan for a tie.
  template <class Visit>
  void for_each(Visit visit) const {
    for (const GridLinks& g : grids) {
      const int j0 = g.dj < 0 ? -g.dj : 0, j1 = g.dj < 0 ? g.cols : g.cols - g.dj;
      const int i0 = g.di < 0 ? -g.di : 0, i1 = g.di < 0 ? g.rows : g.rows - g.di;
      for (int i = i0; i < i1; ++i)
        for (int j = j0; j < j1; ++j) {
          const int a = g.first + i * g.cols + j;
          visit(LinkSpec{a, a + g.di * g.cols + g.dj}, g.rest);
        }
    }
    for (const LinkSpec& tie : ties) visit(tie, std::nan(""));
  }
};

}  // namespace sim
