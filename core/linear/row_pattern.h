// The sparsity pattern of the rows of a Jacobian: equations between nodes.
#pragma once

#include <initializer_list>
#include <span>
#include <vector>

namespace sim {

// The nodes, such as particles, of each equation, one row an equation.
struct RowPattern {
  std::vector<int> begin{0}, ids;  // row r: from ids[begin[r]] to before ids[begin[r + 1]]

  int rows() const { return static_cast<int>(begin.size()) - 1; }
  std::span<const int> of(int row) const {
    const int first = begin[static_cast<std::size_t>(row)];
    return std::span(ids).subspan(
        static_cast<std::size_t>(first),
        static_cast<std::size_t>(begin[static_cast<std::size_t>(row) + 1] - first));
  }
  void add(std::initializer_list<int> nodes) {
    ids.insert(ids.end(), nodes);
    begin.push_back(static_cast<int>(ids.size()));
  }
  // The pattern of `rows` rows for each node alone.
  static RowPattern of_each(const std::vector<int>& nodes, int rows = 1) {
    RowPattern pattern;
    for (const int i : nodes)
      for (int row = 0; row < rows; ++row) pattern.add({i});
    return pattern;
  }
};

}  // namespace sim
