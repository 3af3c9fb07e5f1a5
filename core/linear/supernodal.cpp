#include "core/linear/supernodal.h"

#include <algorithm>
#include <numeric>

#include "core/base/assert.h"

namespace sim {
namespace {

constexpr int kNone = -1;
constexpr int kWidest = 48;  // columns of a panel, so that its products stay in the cache

// The column that row j of L is eliminated into after column i, its parent: the first row below the
// diagonal of column i. Liu (1990), SIAM J. Matrix Anal. Appl. 11(1).
std::vector<int> elimination_tree(const Sparsity& upper) {
  const auto n = static_cast<std::size_t>(upper.size());
  std::vector<int> parents(n, kNone), ancestors(n, kNone);
  for (std::size_t j = 0; j < n; ++j)
    for (int e = upper.begin[j]; e < upper.begin[j + 1]; ++e)
      for (int i = upper.row(e); i != kNone && i < static_cast<int>(j);) {
        int& ancestor = ancestors[static_cast<std::size_t>(i)];
        const int next = ancestor;
        ancestor = static_cast<int>(j);
        if (next == kNone) parents[static_cast<std::size_t>(i)] = static_cast<int>(j);
        i = next;
      }
  return parents;
}

// The place of each node in an order in which all descendants come directly before a node.
std::vector<int> postorder(std::span<const int> parents) {
  const auto n = parents.size();
  std::vector<int> child(n, kNone), sibling(n, kNone), place(n), stack;
  for (std::size_t i = n; i-- > 0;)
    if (parents[i] != kNone) {
      sibling[i] = child[static_cast<std::size_t>(parents[i])];
      child[static_cast<std::size_t>(parents[i])] = static_cast<int>(i);
    }
  int count = 0;
  for (std::size_t root = 0; root < n; ++root) {
    if (parents[root] != kNone) continue;
    stack.push_back(static_cast<int>(root));
    while (!stack.empty()) {
      const auto top = static_cast<std::size_t>(stack.back());
      if (const int next = child[top]; next != kNone) {
        child[top] = sibling[static_cast<std::size_t>(next)];
        stack.push_back(next);
      } else {
        place[top] = count++;
        stack.pop_back();
      }
    }
  }
  return place;
}

// The numbers of entries of L below the diagonals.
std::vector<int> column_counts(const Sparsity& upper, std::span<const int> parents) {
  const auto n = parents.size();
  std::vector<int> counts(n, 0), seen(n, kNone);
  for (std::size_t j = 0; j < n; ++j) {
    seen[j] = static_cast<int>(j);
    for (int e = upper.begin[j]; e < upper.begin[j + 1]; ++e)
      for (auto i = static_cast<std::size_t>(upper.row(e)); seen[i] != static_cast<int>(j);
           i = static_cast<std::size_t>(parents[i])) {
        seen[i] = static_cast<int>(j);
        ++counts[i];
      }
  }
  return counts;
}

// A wider panel takes some zeros along, if they are few (the limits of CHOLMOD).
bool may_join(double columns, double rows, double zeros) {
  const double share = zeros / (columns * (columns + 1) / 2 + columns * (rows - columns));
  return columns <= 4 || (columns <= 16 && share < 0.8) || (columns <= 48 && share < 0.1) ||
         share < 0.05;
}

}  // namespace

SupernodalFactors::SupernodalFactors(const Sparsity& upper) {
  const auto n = static_cast<std::size_t>(upper.size());
  const std::vector<int> tree = elimination_tree(upper);
  order_ = postorder(tree);
  const std::vector<int> numbers = column_counts(upper, tree);
  std::vector<int> parents(n), counts(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(order_[i]);
    parents[at] = tree[i] == kNone ? kNone : order_[static_cast<std::size_t>(tree[i])];
    counts[at] = numbers[i];
  }
  find_rows(supernodes(parents, counts), upper);
  place_entries(upper);

  std::size_t most = 0;
  for (const Panel& panel : panels_) most = std::max(most, static_cast<std::size_t>(panel.count));
  waiting_.resize(panels_.size());
  next_.resize(panels_.size());
  reached_.resize(panels_.size());
  local_.resize(n);
  relative_.resize(most);
  pivots_ = Array(n);
  factor_ = Array(4 * kWidest);
  product_ = Array(4 * (most + 8));
  all_ = Array(n);
  some_ = Array(most + 8);
}

// The first columns of the supernodes, and n.
std::vector<int> SupernodalFactors::supernodes(std::span<const int> parents,
                                               std::span<const int> counts) const {
  struct Supernode {
    int first, columns;
    double rows, zeros;
  };
  std::vector<Supernode> all;
  for (std::size_t j = 0; j < parents.size(); ++j) {
    const bool same =
        j > 0 && parents[j - 1] == static_cast<int>(j) && counts[j - 1] == counts[j] + 1;
    if (same)
      ++all.back().columns;
    else
      all.push_back({static_cast<int>(j), 1, counts[j] + 1.0, 0});
    // Children that end where this begins are joined once it is whole.
    const bool whole = j + 1 == parents.size() || parents[j] != static_cast<int>(j) + 1 ||
                       counts[j] != counts[j + 1] + 1;
    while (whole && all.size() > 1) {
      const Supernode& last = all.back();
      const Supernode& before = all[all.size() - 2];
      if (parents[static_cast<std::size_t>(last.first) - 1] != last.first) break;
      Supernode joined = before;
      joined.columns += last.columns;
      joined.rows = before.columns + last.rows;
      joined.zeros += last.zeros + before.columns * (joined.rows - before.rows);
      if (!may_join(joined.columns, joined.rows, joined.zeros)) break;
      all.pop_back();
      all.back() = joined;
    }
  }
  std::vector<int> first;
  for (const Supernode& each : all) first.push_back(each.first);
  first.push_back(static_cast<int>(parents.size()));
  return first;
}

void SupernodalFactors::find_rows(std::span<const int> first, const Sparsity& upper) {
  const auto n = order_.size();
  // The lower half by columns, in the new order.
  std::vector<std::size_t> starts(n + 1, 0);
  const auto ends_of = [&](std::size_t j, int e) {
    return std::minmax(order_[j], order_[static_cast<std::size_t>(upper.row(e))]);
  };
  for (std::size_t j = 0; j < n; ++j)
    for (int e = upper.begin[j]; e < upper.begin[j + 1]; ++e)
      ++starts[static_cast<std::size_t>(ends_of(j, e).first) + 1];
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  std::vector<int> lower(upper.count());
  std::vector<std::size_t> filled(starts.begin(), starts.end() - 1);
  for (std::size_t j = 0; j < n; ++j)
    for (int e = upper.begin[j]; e < upper.begin[j + 1]; ++e) {
      const auto [column, row] = ends_of(j, e);
      lower[filled[static_cast<std::size_t>(column)]++] = row;
    }

  // The rows of a supernode: those of its columns and of its children that lie in or below it.
  struct Span {
    std::size_t begin, end;
  };
  std::vector<int> seen(n, kNone);
  std::vector<std::vector<std::size_t>> children(first.size() - 1);
  std::vector<Span> own;
  panel_of_.resize(n);
  std::size_t place = 0;
  for (std::size_t s = 0; s + 1 < first.size(); ++s) {
    const std::size_t begin = rows_.size();
    const auto take = [&](int row) {
      if (seen[static_cast<std::size_t>(row)] == static_cast<int>(s)) return;
      seen[static_cast<std::size_t>(row)] = static_cast<int>(s);
      rows_.push_back(row);
    };
    for (int column = first[s]; column < first[s + 1]; ++column) take(column);
    for (auto column = static_cast<std::size_t>(first[s]);
         column < static_cast<std::size_t>(first[s + 1]); ++column)
      for (std::size_t e = starts[column]; e < starts[column + 1]; ++e) take(lower[e]);
    for (const std::size_t child : children[s])
      for (std::size_t i = own[child].begin; i < own[child].end; ++i)
        if (rows_[i] >= first[s]) take(rows_[i]);
    std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(begin), rows_.end());
    own.push_back({begin, rows_.size()});
    const int columns = first[s + 1] - first[s];

    // Wide ones are several panels.
    const int parts = (columns + kWidest - 1) / kWidest;
    for (int part = 0, at = 0; part < parts; ++part) {
      const int end = columns * (part + 1) / parts;
      const std::size_t from = begin + static_cast<std::size_t>(at);
      const int count = static_cast<int>(rows_.size() - from);
      std::fill(panel_of_.begin() + first[s] + at, panel_of_.begin() + first[s] + end,
                static_cast<int>(panels_.size()));
      panels_.push_back({first[s] + at, end - at, from, count, place});
      place += static_cast<std::size_t>(count) * static_cast<std::size_t>(end - at);
      at = end;
    }
    if (const std::size_t below = begin + static_cast<std::size_t>(columns); below < rows_.size()) {
      const auto row = static_cast<std::size_t>(rows_[below]);
      const auto parent =
          std::ranges::upper_bound(first, static_cast<int>(row)) - first.begin() - 1;
      children[static_cast<std::size_t>(parent)].push_back(s);
    }
  }
  numbers_ = Array(place + 8);
}

void SupernodalFactors::place_entries(const Sparsity& upper) {
  entries_.resize(upper.count());
  for (std::size_t j = 0; j < order_.size(); ++j)
    for (int e = upper.begin[j]; e < upper.begin[j + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const auto [column, row] =
          std::minmax(order_[j], order_[static_cast<std::size_t>(upper.rows[at])]);
      const Panel& panel =
          panels_[static_cast<std::size_t>(panel_of_[static_cast<std::size_t>(column)])];
      const int* const own = rows_.data() + panel.rows;
      const int* const found = std::lower_bound(own, own + panel.count, row);
      SIM_ASSERT(found != own + panel.count && *found == row);
      entries_[at] =
          panel.place + static_cast<std::size_t>(found - own) +
          static_cast<std::size_t>(column - panel.first) * static_cast<std::size_t>(panel.count);
    }
}

// The product L D L^T of columns of L, `depth` of them from the row at l on, with up to four of
// its first rows.
void SupernodalFactors::multiply(const double* l, std::ptrdiff_t stride, const double* pivots,
                                 int depth, int rows, int columns) {
  for (int k = 0; k < depth; ++k)
    for (int j = 0; j < 4; ++j)
      factor_[static_cast<std::size_t>(4 * k + j)] =
          j < columns ? pivots[k] * l[k * stride + j] : 0;
  kernels_.multiply(l, stride, rows, factor_.data(), depth, product_.data(),
                    std::ssize(relative_) + 8);
}

// The columns of a panel less the products of another one, whose rows [begin, end) they are.
void SupernodalFactors::update(const Panel& to, const Panel& from, int begin, int end) {
  const int rows = from.count - begin;
  const int* const own = rows_.data() + from.rows + begin;
  for (int i = 0; i < rows; ++i)
    relative_[static_cast<std::size_t>(i)] = local_[static_cast<std::size_t>(own[i])];
  const bool together = relative_[static_cast<std::size_t>(rows) - 1] - relative_[0] == rows - 1;
  const std::ptrdiff_t stride = from.count, height = std::ssize(relative_) + 8;
  const double* const l = columns_of(from) + begin;
  const double* const pivots = pivots_.data() + from.first;
  for (int group = 0; group < end - begin; group += 4) {
    const int columns = std::min(4, end - begin - group);
    multiply(l + group, stride, pivots, from.columns, rows - group, columns);
    for (int j = 0; j < columns; ++j) {
      const double* const product = product_.data() + j * height - group;
      const int* const place = relative_.data();
      double* const target =
          columns_of(to) + static_cast<std::ptrdiff_t>(own[group + j] - to.first) * to.count;
      if (together) {
        double* const first = target + place[0];
        for (int i = group + j; i < rows; ++i) first[i] -= product[i];
      } else {
        for (int i = group + j; i < rows; ++i) target[place[i]] -= product[i];
      }
    }
  }
}

// Four columns at a time take the products of those before them in the panel.
bool SupernodalFactors::eliminate(const Panel& panel, bool positive) {
  double* const l = columns_of(panel);
  const std::ptrdiff_t stride = panel.count, height = std::ssize(relative_) + 8;
  double* const pivots = pivots_.data() + panel.first;
  for (int group = 0; group < panel.columns; group += 4) {
    const int columns = std::min(4, panel.columns - group), rows = panel.count - group;
    double* const diagonal = l + group * stride + group;
    if (group > 0) {
      multiply(l + group, stride, pivots, group, rows, columns);
      for (int j = 0; j < columns; ++j) {
        const double* const product = product_.data() + j * height;
        double* const column = diagonal + j * stride;
        for (int i = j; i < rows; ++i) column[i] -= product[i];
      }
    }
    if (!kernels_.eliminate(diagonal, stride, rows, columns, positive, pivots + group))
      return false;
  }
  return true;
}

bool SupernodalFactors::factorise(std::span<const double> values, bool positive, double shift) {
  std::fill_n(numbers_.data(), numbers_.size(), 0.0);
  for (std::size_t e = 0; e < entries_.size(); ++e) numbers_[entries_[e]] = values[e];
  if (shift != 0)
    for (const Panel& panel : panels_)
      for (int column = 0; column < panel.columns; ++column)
        columns_of(panel)[column * (panel.count + 1)] *= 1 + shift;
  std::ranges::fill(waiting_, kNone);
  for (std::size_t p = 0; p < panels_.size(); ++p) {
    const Panel& panel = panels_[p];
    for (int i = 0; i < panel.count; ++i)
      local_[static_cast<std::size_t>(rows_[panel.rows + static_cast<std::size_t>(i)])] = i;
    const auto wait = [&](std::size_t from, int row) {
      const Panel& each = panels_[from];
      reached_[from] = row;
      if (row == each.count) return;
      const auto column =
          static_cast<std::size_t>(rows_[each.rows + static_cast<std::size_t>(row)]);
      int& list = waiting_[static_cast<std::size_t>(panel_of_[column])];
      next_[from] = list;
      list = static_cast<int>(from);
    };
    for (int from = waiting_[p]; from != kNone;) {
      const auto at = static_cast<std::size_t>(from);
      from = next_[at];
      const Panel& each = panels_[at];
      const int* const own = rows_.data() + each.rows;
      int end = reached_[at];
      while (end < each.count && own[end] < panel.first + panel.columns) ++end;
      update(panel, each, reached_[at], end);
      wait(at, end);
    }
    if (!eliminate(panel, positive)) return false;
    wait(p, panel.columns);
  }
  return true;
}

int SupernodalFactors::negative_pivots() const {
  return static_cast<int>(
      std::ranges::count_if(pivots_.span(), [](double pivot) { return pivot < 0; }));
}

void SupernodalFactors::solve(std::span<double> x) const {
  SIM_ASSERT(x.size() == order_.size());
  for (std::size_t i = 0; i < x.size(); ++i) all_[static_cast<std::size_t>(order_[i])] = x[i];
  const auto gather = [&](const Panel& panel) {
    const int* const rows = rows_.data() + panel.rows;
    for (int i = 0; i < panel.count; ++i)
      some_[static_cast<std::size_t>(i)] = all_[static_cast<std::size_t>(rows[i])];
    std::fill_n(some_.data() + panel.count, 8, 0.0);
  };
  for (const Panel& panel : panels_) {
    gather(panel);
    kernels_.forward(columns_of(panel), panel.count, panel.count, panel.columns, some_.data());
    const int* const rows = rows_.data() + panel.rows;
    for (int i = 0; i < panel.count; ++i)
      all_[static_cast<std::size_t>(rows[i])] = some_[static_cast<std::size_t>(i)];
  }
  for (std::size_t i = 0; i < x.size(); ++i) all_[i] /= pivots_[i];
  for (std::size_t p = panels_.size(); p-- > 0;) {
    const Panel& panel = panels_[p];
    gather(panel);
    kernels_.backward(columns_of(panel), panel.count, panel.count, panel.columns, some_.data());
    std::copy_n(some_.data(), panel.columns, all_.data() + panel.first);
  }
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = all_[static_cast<std::size_t>(order_[i])];
}

std::vector<int> factor_counts(const Sparsity& upper) {
  return column_counts(upper, elimination_tree(upper));
}

}  // namespace sim
