#include "core/linear/row_structure.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "core/base/assert.h"
#include "core/base/disjoint_sets.h"
#include "core/base/slot.h"
#include "core/linear/sparse.h"
#include "core/linear/supernodal.h"

namespace sim {
namespace {

// The mean square of the numbers of a column of L from which panels pay: a net of 24 x 24 rods.
constexpr double kWorthPanels = 250;

// A list of items for each number, one behind the other.
template <class Item>
struct Lists {
  std::vector<int> begin{0};
  std::vector<Item> items;

  int size() const { return static_cast<int>(begin.size()) - 1; }
  std::span<const Item> operator[](int k) const {
    return {items.data() + begin[slot(k)], items.data() + begin[slot(k) + 1]};
  }
  std::span<Item> last() { return {items.data() + begin.back(), items.data() + items.size()}; }
  void close() { begin.push_back(static_cast<int>(items.size())); }
};

// each_item calls take(k, item) for the items of all lists, in the order that each list has them.
template <class Item, class EachItem>
Lists<Item> lists_of(std::size_t size, const EachItem& each_item) {
  Lists<Item> lists;
  lists.begin.assign(size + 1, 0);
  each_item([&](int k, const Item&) { ++lists.begin[slot(k) + 1]; });
  std::partial_sum(lists.begin.begin(), lists.begin.end(), lists.begin.begin());
  lists.items.resize(slot(lists.begin.back()));
  std::vector<int> next = lists.begin;
  each_item([&](int k, const Item& item) { lists.items[slot(next[slot(k)]++)] = item; });
  return lists;
}

using Graph = Lists<int>;  // of each row those before it that it meets, ascending

struct Entry {
  int row, entry;  // of the pattern
};

// The rows that act on each node that moves.
Lists<Entry> rows_at_nodes(const RowPattern& pattern, std::span<const double> weights) {
  return lists_of<Entry>(weights.size(), [&](const auto& take) {
    for (int r = 0; r < pattern.rows(); ++r)
      for (int e = pattern.begin[slot(r)]; e < pattern.begin[slot(r) + 1]; ++e)
        if (const int i = pattern.ids[slot(e)]; weights[slot(i)] > 0) take(i, Entry{r, e});
  });
}

Graph columns_of(const RowPattern& pattern, std::span<const double> weights,
                 const Lists<Entry>& rows_at) {
  Graph columns;
  for (int r = 0; r < pattern.rows(); ++r) {
    for (int e = pattern.begin[slot(r)]; e < pattern.begin[slot(r) + 1]; ++e) {
      const int i = pattern.ids[slot(e)];
      if (!(weights[slot(i)] > 0)) continue;
      for (const Entry& other : rows_at[i])
        if (other.row < r) columns.items.push_back(other.row);
    }
    const std::span<int> own = columns.last();
    std::ranges::sort(own);
    columns.items.resize(columns.items.size() - std::ranges::unique(own).size());
    columns.close();
  }
  return columns;
}

// The numbers of entries of L below the diagonals.
std::vector<int> factor_counts(const Graph& columns) {
  Sparsity upper;
  upper.begin = columns.begin;
  upper.rows = columns.items;
  return factor_counts(upper);
}

// The column indices of each listed row of L, ascending, by the elimination tree (Liu 1990).
Graph rows_of_factor(const Graph& columns, std::span<const std::uint8_t> listed) {
  const int n = columns.size();
  std::vector<int> parent(slot(n), -1), seen(slot(n), -1);
  Graph rows;
  for (int k = 0; k < n; ++k) {
    if (!listed[slot(k)]) {
      rows.close();
      continue;
    }
    seen[slot(k)] = k;
    for (int i : columns[k])
      for (; seen[slot(i)] != k; i = parent[slot(i)]) {
        if (parent[slot(i)] < 0) parent[slot(i)] = k;
        seen[slot(i)] = k;
        rows.items.push_back(i);
      }
    std::ranges::sort(rows.last());
    rows.close();
  }
  return rows;
}

std::size_t sum_of(std::span<const int> counts) {
  return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

// take(i, k) is called for each row k and each row i before it that it meets.
template <class Take>
void each_pair(const Graph& columns, const Take& take) {
  for (int k = 0; k < columns.size(); ++k)
    for (const int i : columns[k]) take(i, k);
}

// The graph with row r renumbered as place[r].
Graph renumbered(const Graph& columns, const std::vector<int>& place) {
  Graph result = lists_of<int>(place.size(), [&](const auto& take) {
    each_pair(columns, [&](int i, int k) {
      const auto [low, high] = std::minmax(place[slot(k)], place[slot(i)]);
      take(high, low);
    });
  });
  for (std::size_t k = 0; k < place.size(); ++k)
    std::sort(result.items.begin() + result.begin[k], result.items.begin() + result.begin[k + 1]);
  return result;
}

// The component of each row, numbered in the order of their first rows.
std::vector<int> components_of(const Graph& columns) {
  const int n = columns.size();
  DisjointSets joined(slot(n));
  each_pair(columns, [&](int i, int k) { joined.join(k, i); });
  int count = 0;
  std::vector<int> component(slot(n));
  for (int k = 0; k < n; ++k) {
    const int root = joined.root(k);
    component[slot(k)] = root == k ? count++ : component[slot(root)];
  }
  return component;
}

// The place of each row in the elimination order: as given, unless minimum degree has less fill.
std::vector<int> places_of(const Graph& columns) {
  const auto fill = [](const Graph& graph) { return sum_of(factor_counts(graph)); };
  std::vector<int> place(slot(columns.size()));
  std::iota(place.begin(), place.end(), 0);
  const std::size_t given = fill(columns);
  if (given == columns.items.size()) return place;
  std::vector<std::array<int, 2>> pairs;
  each_pair(columns, [&](int i, int k) { pairs.push_back({i, k}); });
  std::vector<int> other = little_fill(columns.size(), std::move(pairs));
  return fill(renumbered(columns, other)) < given ? other : place;
}

}  // namespace

RowStructure::RowStructure(const RowPattern& pattern, std::span<const double> weights,
                           std::span<const std::uint8_t> orthogonal)
    : size(pattern.rows()) {
  SIM_ASSERT(pattern.begin.back() == static_cast<int>(pattern.ids.size()));
  SIM_ASSERT(std::ranges::all_of(weights, [](double weight) { return weight >= 0; }));
  const Lists<Entry> rows_at = rows_at_nodes(pattern, weights);
  Graph columns = columns_of(pattern, weights, rows_at);

  // Component by component, each in the elimination order.
  std::vector<int> place = places_of(columns);
  const std::vector<int> component = components_of(columns);
  row_at.resize(slot(size));
  for (int r = 0; r < size; ++r) row_at[slot(place[slot(r)])] = r;
  std::ranges::stable_sort(row_at, {}, [&](int r) { return component[slot(r)]; });
  for (int k = 0; k < size; ++k) {
    const std::size_t row = slot(row_at[slot(k)]);
    place[row] = k;
    if (component[row] == static_cast<int>(components.size()))
      components.push_back({.begin = k, .orthogonal = true});
    Component& of = components.back();
    of.end = k + 1;
    of.orthogonal = of.orthogonal && !orthogonal.empty() && orthogonal[row];
  }
  columns = renumbered(columns, place);

  // The entries of A, and the products that each of them sums.
  entry_begin.push_back(0);
  for (int k = 0; k < size; ++k) {
    entry_row.insert(entry_row.end(), columns[k].begin(), columns[k].end());
    entry_row.push_back(k);
    entry_begin.push_back(static_cast<int>(entry_row.size()));
  }
  Lists<Product> sums = lists_of<Product>(entry_row.size(), [&](const auto& take) {
    for (int i = 0; i < rows_at.size(); ++i)
      for (const auto& [s, f] : rows_at[i])
        for (const auto& [r, e] : rows_at[i]) {
          const int low = place[slot(s)], high = place[slot(r)];
          if (low > high || (r == s && f != e)) continue;
          const auto begin = entry_row.begin() + entry_begin[slot(high)],
                     end = entry_row.begin() + entry_begin[slot(high) + 1];
          const auto entry = std::lower_bound(begin, end, low) - entry_row.begin();
          take(static_cast<int>(entry), Product{f, e, i});
        }
  });
  product_begin = std::move(sums.begin);
  products = std::move(sums.items);

  // The factor: which components have panels, and the lists of the others.
  const std::vector<int> counts = factor_counts(columns);
  std::size_t work = 0;
  for (Component& each : components) {
    const std::span<const int> own(counts.data() + each.begin, counts.data() + each.end);
    const std::size_t filled = sum_of(own);
    fill += filled;
    work += own.size() + filled;
    each.work = work;
    double products = 0;
    for (const double count : own) products += count * count;
    each.in_panels = products > kWorthPanels * static_cast<double>(own.size());
  }
  std::vector<std::uint8_t> listed(slot(size));
  for (const Component& each : components)
    std::fill(listed.begin() + each.begin, listed.begin() + each.end, !each.in_panels);
  const Graph factor = rows_of_factor(columns, listed);
  place_begin = factor.begin;
  places.reserve(factor.items.size());
  const Graph by_columns = lists_of<int>(slot(size), [&](const auto& take) {
    each_pair(factor, [&](int column, int k) { take(column, k); });
  });
  column_begin = by_columns.begin;
  rows = by_columns.items;
  std::vector<int> next = column_begin;
  each_pair(factor, [&](int column, int) { places.push_back({column, next[slot(column)]++}); });
}

Sparsity RowStructure::entries_of(const Component& component) const {
  const auto first = entry_begin.begin() + component.begin;
  Sparsity upper;
  for (auto at = first; at <= entry_begin.begin() + component.end; ++at)
    upper.begin.push_back(*at - *first);
  for (int e = *first; e < entry_begin[slot(component.end)]; ++e)
    upper.rows.push_back(entry_row[slot(e)] - component.begin);
  return upper;
}

}  // namespace sim
