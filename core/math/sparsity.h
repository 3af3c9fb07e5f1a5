// Sparsity patterns of square matrices: the entries that may differ from 0.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace sim {

// Column by column, with ascending rows in each.
struct Sparsity {
  std::vector<int> begin;  // of each column in `rows`; one number more than there are columns
  std::vector<int> rows;

  Sparsity() = default;
  // From entries {column, row} in any order; duplicates count once.
  Sparsity(int size, std::vector<std::pair<int, int>> entries)
      : begin(static_cast<std::size_t>(size) + 1, 0) {
    std::ranges::sort(entries);
    entries.erase(std::unique(entries.begin(), entries.end()), entries.end());
    for (const auto& [column, row] : entries) {
      ++begin[static_cast<std::size_t>(column) + 1];
      rows.push_back(row);
    }
    for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  }

  int size() const { return static_cast<int>(begin.size()) - 1; }
  std::size_t count() const { return rows.size(); }
  int begin_of(int column) const { return begin[static_cast<std::size_t>(column)]; }
  int end_of(int column) const { return begin[static_cast<std::size_t>(column) + 1]; }
  int row(int entry) const { return rows[static_cast<std::size_t>(entry)]; }

  // The number of the entry there, or -1.
  int find(int column, int wanted) const {
    const auto first = rows.begin() + begin_of(column), last = rows.begin() + end_of(column);
    const auto found = std::lower_bound(first, last, wanted);
    return found != last && *found == wanted ? static_cast<int>(found - rows.begin()) : -1;
  }

  bool operator==(const Sparsity&) const = default;
};

}  // namespace sim
