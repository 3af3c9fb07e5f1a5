#include "core/plugin/links.h"

#include <cstdlib>

namespace sim {

std::size_t Links::count() const {
  std::size_t sum = ties.size();
  for (const GridLinks& g : grids) {
    const int rows = g.rows - std::abs(g.di), cols = g.cols - std::abs(g.dj);
    if (rows > 0 && cols > 0)
      sum += static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols);
  }
  return sum;
}

}  // namespace sim
