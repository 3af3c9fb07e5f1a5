// The sparsity pattern of the rows of a Jacobian: equations between nodes.
#pragma once

#include <algorithm>
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
  // The rows before which it may be cut: 0, each row that shares no node with those before it and
  // behind which none does, and rows().
  std::vector<int> cuts() const {
    std::vector<int> last, cuts;  // the last row of each node
    for (int r = 0; r < rows(); ++r)
      for (const int i : of(r)) {
        if (last.size() <= static_cast<std::size_t>(i))
          last.resize(static_cast<std::size_t>(i) + 1);
        last[static_cast<std::size_t>(i)] = r;
      }
    int joined = -1;  // the last row that shares a node with one so far
    for (int r = 0; r < rows(); ++r) {
      if (r > joined) cuts.push_back(r);
      for (const int i : of(r)) joined = std::max(joined, last[static_cast<std::size_t>(i)]);
    }
    cuts.push_back(rows());
    return cuts;
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
