#include "core/linear/row_matrix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/base/assert.h"
#include "core/base/disjoint_sets.h"
#include "core/linear/sparse.h"

namespace sim {
namespace {

using Graph = std::vector<std::vector<int>>;  // of each row those before it that it meets

// The column indices of each row of L, ascending, by the elimination tree (Liu 1990).
Graph rows_of_factor(const Graph& columns) {
  const int n = static_cast<int>(columns.size());
  std::vector<int> parent(columns.size(), -1), seen(columns.size(), -1);
  Graph rows(columns.size());
  for (int k = 0; k < n; ++k) {
    const auto at = static_cast<std::size_t>(k);
    seen[at] = k;
    for (int i : columns[at])
      for (; seen[static_cast<std::size_t>(i)] != k; i = parent[static_cast<std::size_t>(i)]) {
        const auto on_way = static_cast<std::size_t>(i);
        if (parent[on_way] < 0) parent[on_way] = k;
        seen[on_way] = k;
        rows[at].push_back(i);
      }
    std::ranges::sort(rows[at]);
  }
  return rows;
}

std::size_t count(const Graph& rows) {
  std::size_t sum = 0;
  for (const auto& row : rows) sum += row.size();
  return sum;
}

// The graph with row r renumbered as place[r].
Graph renumbered(const Graph& columns, const std::vector<int>& place) {
  Graph result(columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const int i : columns[k]) {
      const auto [low, high] = std::minmax(place[k], place[static_cast<std::size_t>(i)]);
      result[static_cast<std::size_t>(high)].push_back(low);
    }
  for (auto& column : result) std::ranges::sort(column);
  return result;
}

// The component of each row, numbered in the order of their first rows.
std::vector<int> components_of(const Graph& columns) {
  DisjointSets joined(columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const int i : columns[k]) joined.join(static_cast<int>(k), i);
  int count = 0;
  std::vector<int> component(columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const auto root = slot(joined.root(static_cast<int>(k)));
    component[k] = root == k ? count++ : component[root];
  }
  return component;
}

std::vector<std::array<int, 2>> pairs_of(const Graph& columns) {
  std::vector<std::array<int, 2>> pairs;
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const int i : columns[k]) pairs.push_back({i, static_cast<int>(k)});
  return pairs;
}

}  // namespace

RowMatrix::RowMatrix(const RowPattern& pattern, std::span<const double> weights,
                     std::span<const std::uint8_t> orthogonal)
    : size_(pattern.rows()) {
  const auto n = static_cast<std::size_t>(size_);
  SIM_ASSERT(pattern.begin.back() == static_cast<int>(pattern.ids.size()));
  SIM_ASSERT(std::ranges::all_of(weights, [](double weight) { return weight >= 0; }));
  // The rows that act on each node, with their entries.
  std::vector<std::vector<std::pair<int, int>>> rows_at(weights.size());  // row, entry
  for (int r = 0; r < size_; ++r)
    for (int e = pattern.begin[static_cast<std::size_t>(r)];
         e < pattern.begin[static_cast<std::size_t>(r) + 1]; ++e) {
      const auto i = static_cast<std::size_t>(pattern.ids[static_cast<std::size_t>(e)]);
      if (weights[i] > 0) rows_at[i].emplace_back(r, e);
    }
  Graph columns(n);
  for (const auto& here : rows_at)
    for (const auto& [r, e] : here)
      for (const auto& [s, f] : here)
        if (s < r) columns[static_cast<std::size_t>(r)].push_back(s);
  for (auto& column : columns) {
    std::ranges::sort(column);
    column.erase(std::unique(column.begin(), column.end()), column.end());
  }

  // The elimination order: as given, unless minimum degree has less fill.
  std::vector<int> place(n);
  for (int r = 0; r < size_; ++r) place[static_cast<std::size_t>(r)] = r;
  if (const std::size_t least = count(columns); count(rows_of_factor(columns)) > least) {
    std::vector<int> other = little_fill(size_, pairs_of(columns));
    if (count(rows_of_factor(renumbered(columns, other))) < count(rows_of_factor(columns)))
      place = std::move(other);
  }
  // Component by component, each in that order.
  const std::vector<int> component = components_of(columns);
  row_at_.resize(n);
  for (int r = 0; r < size_; ++r)
    row_at_[static_cast<std::size_t>(place[static_cast<std::size_t>(r)])] = r;
  std::ranges::stable_sort(row_at_, {},
                           [&](int r) { return component[static_cast<std::size_t>(r)]; });
  for (int k = 0; k < size_; ++k) {
    const auto row = static_cast<std::size_t>(row_at_[static_cast<std::size_t>(k)]);
    place[row] = k;
    if (component[row] == static_cast<int>(components_.size()))
      components_.push_back({.begin = k, .orthogonal = true});
    Component& of = components_.back();
    of.end = k + 1;
    of.orthogonal = of.orthogonal && !orthogonal.empty() && orthogonal[row];
  }
  columns = renumbered(columns, place);

  // The entries of A, and the products that each of them sums.
  entry_begin_.push_back(0);
  for (int k = 0; k < size_; ++k) {
    for (const int i : columns[static_cast<std::size_t>(k)]) entry_row_.push_back(i);
    entry_row_.push_back(k);
    entry_begin_.push_back(static_cast<int>(entry_row_.size()));
  }
  std::vector<std::tuple<int, int, int, int>> parts;  // entry, node, a, b
  for (std::size_t i = 0; i < rows_at.size(); ++i)
    for (const auto& [r, e] : rows_at[i])
      for (const auto& [s, f] : rows_at[i]) {
        const int low = place[static_cast<std::size_t>(s)],
                  high = place[static_cast<std::size_t>(r)];
        if (low > high || (r == s && f != e)) continue;
        const auto begin = entry_row_.begin() + entry_begin_[static_cast<std::size_t>(high)];
        const auto end = entry_row_.begin() + entry_begin_[static_cast<std::size_t>(high) + 1];
        const auto entry = std::lower_bound(begin, end, low) - entry_row_.begin();
        parts.emplace_back(static_cast<int>(entry), static_cast<int>(i), f, e);
      }
  std::ranges::sort(parts);
  product_begin_.assign(entry_row_.size() + 1, 0);
  for (const auto& [entry, i, a, b] : parts) {
    products_.push_back({a, b, i});
    ++product_begin_[static_cast<std::size_t>(entry) + 1];
  }
  for (std::size_t k = 1; k < product_begin_.size(); ++k)
    product_begin_[k] += product_begin_[k - 1];
  entries_.resize(entry_row_.size());
  analyse(columns);
}

void RowMatrix::analyse(const std::vector<std::vector<int>>& columns) {
  const auto n = static_cast<std::size_t>(size_);
  const Graph rows = rows_of_factor(columns);
  column_begin_.assign(n + 1, 0);
  for (const auto& row : rows)
    for (const int column : row) ++column_begin_[static_cast<std::size_t>(column) + 1];
  for (std::size_t k = 1; k <= n; ++k) column_begin_[k] += column_begin_[k - 1];
  std::vector<int> next(column_begin_.begin(), column_begin_.end());
  rows_.resize(static_cast<std::size_t>(column_begin_.back()));
  place_begin_.push_back(0);
  for (int k = 0; k < size_; ++k) {
    for (const int column : rows[static_cast<std::size_t>(k)]) {
      const int slot = next[static_cast<std::size_t>(column)]++;
      rows_[static_cast<std::size_t>(slot)] = k;
      places_.push_back({column, slot});
    }
    place_begin_.push_back(static_cast<int>(places_.size()));
  }
  values_.resize(rows_.size());
  for (std::vector<double>* each : {&inverse_, &work_, &x_, &rest_, &found_}) each->assign(n, 0);
  empty_.assign(n, 0);
  std::size_t work = 0;
  for (Component& each : components_) {
    const auto begin = static_cast<std::size_t>(each.begin),
               end = static_cast<std::size_t>(each.end);
    work += end - begin + static_cast<std::size_t>(place_begin_[end] - place_begin_[begin]);
    each.work = work;
  }
}

// Threads take components in their order, so that each has about as much work.
template <class Body>
void RowMatrix::for_each(const Body& body) {
  constexpr std::size_t kWorthThreads = 10'000;  // numbers of L
  if (!pool_ || components_.size() < 2 || rows_.size() < kWorthThreads) {
    for (Component& each : components_) body(each);
    return;
  }
  pool_->run([&](int rank) {
    const auto ranks = static_cast<std::size_t>(pool_->size());
    for (Component& each : components_)
      if ((each.work - 1) * ranks / components_.back().work == static_cast<std::size_t>(rank))
        body(each);
  });
}

int RowMatrix::dependent() const {
  int sum = 0;
  for (const Component& each : components_) sum += each.dependent;
  return sum;
}

int RowMatrix::first_dependent() const {
  for (const Component& each : components_)
    if (each.dependent > 0) return each.first_dependent;
  return -1;
}

void RowMatrix::factorise(std::span<const Vec3> gradient, std::span<const double> weights,
                          double shift) {
  SIM_ASSERT(product_begin_.size() == entries_.size() + 1 && shift >= 0);
  for_each([&](Component& of) { factorise(of, gradient, weights, shift); });
}

void RowMatrix::factorise_obeyed(std::span<const Vec3> gradient, std::span<const double> weights) {
  for_each([&](Component& of) {
    if (!of.orthogonal || !fill_diagonal(of, gradient, weights)) {
      factorise(of, gradient, weights, 0);
      return;
    }
    of.diagonal = true;
    of.dependent = 0;
    of.first_dependent = -1;
  });
}

void RowMatrix::factorise(Component& of, std::span<const Vec3> gradient,
                          std::span<const double> weights, double shift) {
  constexpr double kShift = 1e-9;
  add_up(of, gradient, weights);
  of.diagonal = false;
  of.dependent = 0;
  of.first_dependent = -1;
  of.shifted = shift > 0 || !eliminate(of, 0);
  if (of.shifted) eliminate(of, std::max(shift, kShift));
}

// False if weights differ, or a row has none.
bool RowMatrix::fill_diagonal(const Component& of, std::span<const Vec3> gradient,
                              std::span<const double> weights) {
  double weight = 0;
  for (int k = of.begin; k < of.end; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const auto diagonal = static_cast<std::size_t>(entry_begin_[at + 1]) - 1;
    double sum = 0;
    for (int p = product_begin_[diagonal]; p < product_begin_[diagonal + 1]; ++p) {
      const Product& product = products_[static_cast<std::size_t>(p)];
      const double own = weights[static_cast<std::size_t>(product.node)];
      if (weight == 0) weight = own;
      if (own != weight) return false;
      sum += gradient[static_cast<std::size_t>(product.a)].squaredNorm();
    }
    if (!(sum > 0)) return false;
    inverse_[at] = 1 / (weight * sum);
    empty_[at] = 0;
  }
  return true;
}

// The entries of A.
void RowMatrix::add_up(const Component& of, std::span<const Vec3> gradient,
                       std::span<const double> weights) {
  const auto end = static_cast<std::size_t>(entry_begin_[static_cast<std::size_t>(of.end)]);
  for (auto e = static_cast<std::size_t>(entry_begin_[static_cast<std::size_t>(of.begin)]); e < end;
       ++e) {
    double sum = 0;
    for (int p = product_begin_[e]; p < product_begin_[e + 1]; ++p) {
      const Product& product = products_[static_cast<std::size_t>(p)];
      sum += weights[static_cast<std::size_t>(product.node)] *
             gradient[static_cast<std::size_t>(product.a)].dot(
                 gradient[static_cast<std::size_t>(product.b)]);
    }
    entries_[e] = sum;
  }
}

// False if a pivot is so small that its row seems to depend on the rows before it.
bool RowMatrix::eliminate(Component& of, double shift) {
  constexpr double kLeastPivot = 1e-11;
  bool regular = true;
  for (int k = of.begin; k < of.end; ++k) {
    const auto at = static_cast<std::size_t>(k);
    for (int e = entry_begin_[at]; e < entry_begin_[at + 1]; ++e)
      work_[static_cast<std::size_t>(entry_row_[static_cast<std::size_t>(e)])] =
          entries_[static_cast<std::size_t>(e)];
    const double diagonal = work_[at];
    double d = diagonal * (1 + shift);
    work_[at] = 0;
    for (int p = place_begin_[at]; p < place_begin_[at + 1]; ++p) {
      const auto [column, slot] = places_[static_cast<std::size_t>(p)];
      const auto c = static_cast<std::size_t>(column);
      const double y = work_[c];
      work_[c] = 0;
      for (int q = column_begin_[c]; q < slot; ++q)
        work_[static_cast<std::size_t>(rows_[static_cast<std::size_t>(q)])] -=
            values_[static_cast<std::size_t>(q)] * y;
      const double l = y * inverse_[c];
      d -= l * y;
      values_[static_cast<std::size_t>(slot)] = l;
    }
    empty_[at] = !(diagonal > 0 || diagonal < 0 || diagonal != diagonal);
    if (empty_[at]) {
      d = 1;
    } else if (shift == 0 && d <= kLeastPivot * diagonal) {
      ++of.dependent;
      if (of.first_dependent < 0) of.first_dependent = row_at_[at];
      regular = false;
      d = diagonal;  // the rows that follow are looked at all the same
    }
    inverse_[at] = 1 / d;
  }
  return regular;
}

// Forward and backward substitution.
void RowMatrix::substitute(const Component& of, double* x) const {
  for (int k = of.begin; k < of.end; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double y = x[k];
    for (int q = column_begin_[at]; q < column_begin_[at + 1]; ++q)
      x[rows_[static_cast<std::size_t>(q)]] -= values_[static_cast<std::size_t>(q)] * y;
  }
  for (int k = of.end - 1; k >= of.begin; --k) {
    const auto at = static_cast<std::size_t>(k);
    double sum = x[k] * inverse_[at];
    for (int q = column_begin_[at]; q < column_begin_[at + 1]; ++q)
      sum -= values_[static_cast<std::size_t>(q)] * x[rows_[static_cast<std::size_t>(q)]];
    x[k] = sum;
  }
}

// out := A x, in the elimination order.
void RowMatrix::multiply(const Component& of, const double* x, double* out) const {
  std::fill(out + of.begin, out + of.end, 0.0);
  for (int k = of.begin; k < of.end; ++k) {
    const auto at = static_cast<std::size_t>(k);
    for (int e = entry_begin_[at]; e < entry_begin_[at + 1]; ++e) {
      const int i = entry_row_[static_cast<std::size_t>(e)];
      const double value = entries_[static_cast<std::size_t>(e)];
      out[i] += value * x[k];
      if (i != k) out[k] += value * x[i];
    }
  }
}

// Proximal steps from 0 for the right-hand side x_, to rounding.
void RowMatrix::refine(const Component& of) {
  constexpr int kMost = 4;
  constexpr double kRounding = 1e-15;
  const auto begin = static_cast<std::size_t>(of.begin), end = static_cast<std::size_t>(of.end);
  double given = 0;
  for (std::size_t k = begin; k < end; ++k) {
    rest_[k] = x_[k];
    found_[k] = 0;
    given = std::max(given, std::fabs(x_[k]));
  }
  for (int turn = 0; turn < kMost; ++turn) {
    substitute(of, rest_.data());
    for (std::size_t k = begin; k < end; ++k) found_[k] += rest_[k];
    if (turn + 1 == kMost) break;
    multiply(of, found_.data(), rest_.data());
    double left = 0;
    for (std::size_t k = begin; k < end; ++k) {
      rest_[k] = empty_[k] ? 0.0 : x_[k] - rest_[k];
      left = std::max(left, std::fabs(rest_[k]));
    }
    if (left <= kRounding * given) break;
  }
  std::copy(found_.begin() + of.begin, found_.begin() + of.end, x_.begin() + of.begin);
}

void RowMatrix::solve(double* x) {
  for_each([&](const Component& of) {
    const auto begin = static_cast<std::size_t>(of.begin), end = static_cast<std::size_t>(of.end);
    if (of.diagonal) {
      for (std::size_t k = begin; k < end; ++k) x[slot(row_at_[k])] *= inverse_[k];
      return;
    }
    for (std::size_t k = begin; k < end; ++k)
      x_[k] = empty_[k] ? 0.0 : x[static_cast<std::size_t>(row_at_[k])];
    if (of.shifted)
      refine(of);
    else
      substitute(of, x_.data());
    for (std::size_t k = begin; k < end; ++k) x[static_cast<std::size_t>(row_at_[k])] = x_[k];
  });
}

}  // namespace sim
