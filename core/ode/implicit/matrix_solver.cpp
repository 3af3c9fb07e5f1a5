#include "core/ode/implicit/matrix_solver.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/slot.h"

namespace sim {
namespace {

using Eigen::SparseMatrix;

// The neighbours of each unknown in the symmetric graph, itself left out.
std::vector<std::vector<int>> neighbours_of(const Sparsity& sparsity) {
  std::vector<std::vector<int>> joined(slot(sparsity.size()));
  for (int column = 0; column < sparsity.size(); ++column)
    for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
      if (const int row = sparsity.row(k); row != column) {
        joined[slot(column)].push_back(row);
        joined[slot(row)].push_back(column);
      }
  for (std::vector<int>& list : joined) {
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return joined;
}

// The connected components of the graph; each ascending.
std::vector<std::vector<int>> groups_of(const std::vector<std::vector<int>>& joined) {
  std::vector<std::vector<int>> groups;
  std::vector<bool> seen(joined.size(), false);
  for (int first = 0; first < static_cast<int>(joined.size()); ++first) {
    if (seen[slot(first)]) continue;
    std::vector<int> group{first};
    seen[slot(first)] = true;
    for (std::size_t k = 0; k < group.size(); ++k)
      for (const int other : joined[slot(group[k])])
        if (!seen[slot(other)]) {
          seen[slot(other)] = true;
          group.push_back(other);
        }
    std::ranges::sort(group);
    groups.push_back(std::move(group));
  }
  return groups;
}

// Cuthill & McKee (1969): by distance from a peripheral unknown, those of few neighbours first.
std::vector<int> narrow_order(const std::vector<std::vector<int>>& joined) {
  const auto degree = [&](int i) { return joined[slot(i)].size(); };
  std::vector<int> order;
  std::vector<bool> seen(joined.size());
  const auto spread = [&](int start) {
    std::vector<int> found{start};
    seen[slot(start)] = true;
    for (std::size_t k = 0; k < found.size(); ++k) {
      std::vector<int> next;
      for (const int other : joined[slot(found[k])])
        if (!seen[slot(other)]) {
          seen[slot(other)] = true;
          next.push_back(other);
        }
      std::ranges::stable_sort(next, {}, degree);
      found.insert(found.end(), next.begin(), next.end());
    }
    return found;
  };
  for (const std::vector<int>& group : groups_of(joined)) {
    int start = *std::ranges::min_element(group, {}, degree);
    for (int n = 0; n < 3; ++n) {  // the unknown furthest from it is peripheral
      const std::vector<int> found = spread(start);
      for (const int i : found) seen[slot(i)] = false;
      start = found.back();
    }
    const std::vector<int> found = spread(start);
    order.insert(order.end(), found.begin(), found.end());
  }
  return order;
}

// Gaussian elimination with partial pivoting in dense blocks of unknowns, each row by row.
class DenseBlocks final : public MatrixSolver {
 public:
  DenseBlocks(const Sparsity& sparsity, std::vector<std::vector<int>> groups)
      : groups_(std::move(groups)) {
    std::vector<int> place(slot(sparsity.size()), 0), group_of(slot(sparsity.size()), 0);
    std::size_t size = 0, longest = 0;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      begin_.push_back(size);
      for (std::size_t k = 0; k < groups_[g].size(); ++k) {
        place[slot(groups_[g][k])] = static_cast<int>(k);
        group_of[slot(groups_[g][k])] = static_cast<int>(g);
      }
      size += groups_[g].size() * groups_[g].size();
      longest = std::max(longest, groups_[g].size());
    }
    numbers_.resize(size);
    from_.resize(slot(sparsity.size()));
    part_.resize(longest);
    for (int column = 0; column < sparsity.size(); ++column)
      for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k) {
        const std::size_t g = slot(group_of[slot(column)]), many = groups_[g].size();
        targets_.push_back(begin_[g] + slot(place[slot(sparsity.row(k))]) * many +
                           slot(place[slot(column)]));
      }
  }

  bool factorise(double tau, std::span<const double> values) override {
    std::ranges::fill(numbers_, 0.0);
    for (std::size_t k = 0; k < values.size(); ++k) numbers_[targets_[k]] = -tau * values[k];
    std::size_t first = 0;
    bool regular = true;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const std::size_t n = groups_[g].size();
      double* const a = numbers_.data() + begin_[g];
      for (std::size_t i = 0; i < n; ++i) a[i * n + i] += 1;
      std::ranges::copy(groups_[g], from_.begin() + static_cast<std::ptrdiff_t>(first));
      regular = eliminate(a, n, from_.data() + first) && regular;
      first += n;
    }
    return regular;
  }

  void solve(double* x) override {
    const int* from = from_.data();
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const double* const a = numbers_.data() + begin_[g];
      const int* const to = groups_[g].data();
      const std::size_t n = groups_[g].size();
      switch (n) {
        case 1:
          substitute<1>(a, n, from, to, x);
          break;
        case 2:
          substitute<2>(a, n, from, to, x);
          break;
        case 3:
          substitute<3>(a, n, from, to, x);
          break;
        case 4:
          substitute<4>(a, n, from, to, x);
          break;
        default:
          substitute<0>(a, n, from, to, x);
      }
      from += n;
    }
  }

  std::string name() const override {
    return groups_.size() == 1 ? "dense" : std::to_string(groups_.size()) + " blocks";
  }

 private:
  // L below the diagonal, U above it, and on it the inverses of the pivots.
  // The rows of `from` are exchanged likewise.
  static bool eliminate(double* a, std::size_t n, int* from) {
    for (std::size_t k = 0; k < n; ++k) {
      std::size_t pivot = k;
      for (std::size_t i = k + 1; i < n; ++i)
        if (std::fabs(a[i * n + k]) > std::fabs(a[pivot * n + k])) pivot = i;
      if (pivot != k) std::swap_ranges(a + k * n, a + (k + 1) * n, a + pivot * n);
      std::swap(from[k], from[pivot]);
      const double inverse = 1 / a[k * n + k];
      if (!std::isfinite(inverse)) return false;
      for (std::size_t i = k + 1; i < n; ++i) {
        if (a[i * n + k] == 0) continue;
        const double factor = a[i * n + k] *= inverse;
        for (std::size_t j = k + 1; j < n; ++j) a[i * n + j] -= factor * a[k * n + j];
      }
      a[k * n + k] = inverse;
    }
    return true;
  }

  // x[to[i]] := the solution with the right-hand side x[from[i]]. N: the size, whose numbers then
  // stay in registers; 0: n of them, by way of part_.
  template <std::size_t N>
  void substitute(const double* a, std::size_t n, const int* from, const int* to, double* x) {
    std::array<double, N> few;
    double* const part = N > 0 ? few.data() : part_.data();
    if (N > 0) n = N;
#pragma GCC unroll 4
    for (std::size_t i = 0; i < n; ++i) {
      part[i] = x[from[i]];
      for (std::size_t j = 0; j < i; ++j) part[i] -= a[i * n + j] * part[j];
    }
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t j = i + 1; j < n; ++j) part[i] -= a[i * n + j] * part[j];
      part[i] *= a[i * n + i];
    }
#pragma GCC unroll 4
    for (std::size_t i = 0; i < n; ++i) x[to[i]] = part[i];
  }

  std::vector<std::vector<int>> groups_;
  std::vector<std::size_t> begin_, targets_;  // of each block and each entry in numbers_
  std::vector<double> numbers_, part_;
  std::vector<int> from_;  // the numbers of each block in the order of the rows of its factors
};

// The half bandwidths below and above the diagonal in this order of the unknowns.
struct Width {
  int below = 0, above = 0;
  double operations(int size) const { return 2.0 * size * (below + 1) * (below + above + 1); }
};

std::vector<int> places_of(const std::vector<int>& order, int size) {
  std::vector<int> place(slot(size));
  std::iota(place.begin(), place.end(), 0);
  for (std::size_t i = 0; i < order.size(); ++i) place[slot(order[i])] = static_cast<int>(i);
  return place;
}

Width width_of(const Sparsity& sparsity, const std::vector<int>& order) {
  const std::vector<int> place = places_of(order, sparsity.size());
  Width width;
  for (int column = 0; column < sparsity.size(); ++column)
    for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k) {
      const int down = place[slot(sparsity.row(k))] - place[slot(column)];
      width.below = std::max(width.below, down);
      width.above = std::max(width.above, -down);
    }
  return width;
}

// Gaussian elimination with partial pivoting in a band: column j holds the rows j - above_ - below_
// to j + below_, since exchanged rows reach further to the right.
class Band final : public MatrixSolver {
 public:
  // `order`: the unknown of each row of the matrix; empty: as they are.
  Band(const Sparsity& sparsity, std::vector<int> order)
      : size_(sparsity.size()), order_(std::move(order)) {
    const Width width = width_of(sparsity, order_);
    below_ = width.below;
    above_ = width.above;
    pitch_ = 2 * below_ + above_ + 1;
    numbers_.resize(slot(size_) * slot(pitch_));
    pivots_.resize(slot(size_));
    part_.resize(order_.size());
    const std::vector<int> place = places_of(order_, size_);
    for (int column = 0; column < size_; ++column)
      for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
        targets_.push_back(index(place[slot(sparsity.row(k))], place[slot(column)]));
  }

  bool factorise(double tau, std::span<const double> values) override {
    std::ranges::fill(numbers_, 0.0);
    for (std::size_t k = 0; k < values.size(); ++k) numbers_[targets_[k]] = -tau * values[k];
    for (int i = 0; i < size_; ++i) numbers_[index(i, i)] += 1;
    int reach = 0;  // the last column that a row so far has an entry in
    for (int k = 0; k < size_; ++k) {
      double* const column = numbers_.data() + index(k, k);
      const int rows = std::min(below_, size_ - 1 - k);
      int pivot = 0;
      for (int i = 1; i <= rows; ++i)
        if (std::fabs(column[i]) > std::fabs(column[pivot])) pivot = i;
      pivots_[slot(k)] = pivot;
      reach = std::max(reach, std::min(k + above_ + pivot, size_ - 1));
      std::swap(column[0], column[pivot]);
      const double inverse = 1 / column[0];
      if (!std::isfinite(inverse)) return false;
      column[0] = inverse;
      for (int i = 1; i <= rows; ++i) column[i] *= inverse;
      for (int j = k + 1; j <= reach; ++j) {
        double* const other = numbers_.data() + index(k, j);
        std::swap(other[0], other[pivot]);
        const double factor = other[0];
        if (factor == 0) continue;
        for (int i = 1; i <= rows; ++i) other[i] -= factor * column[i];
      }
    }
    return true;
  }

  void solve(double* x) override {
    double* const y = order_.empty() ? x : part_.data();
    for (std::size_t i = 0; i < order_.size(); ++i) y[i] = x[order_[i]];
    for (int k = 0; k < size_; ++k) {
      const double* const column = numbers_.data() + index(k, k);
      std::swap(y[k], y[k + pivots_[slot(k)]]);
      const int rows = std::min(below_, size_ - 1 - k);
      for (int i = 1; i <= rows; ++i) y[k + i] -= column[i] * y[k];
    }
    for (int k = size_ - 1; k >= 0; --k) {
      const double* const column = numbers_.data() + index(k, k);
      y[k] *= column[0];
      const int rows = std::min(below_ + above_, k);
      for (int i = 1; i <= rows; ++i) y[k - i] -= column[-i] * y[k];
    }
    for (std::size_t i = 0; i < order_.size(); ++i) x[order_[i]] = y[i];
  }

  std::string name() const override {
    return "band " + std::to_string(below_) + " + " + std::to_string(above_);
  }

 private:
  std::size_t index(int row, int column) const {
    return slot(column) * slot(pitch_) + slot(below_ + above_ + row - column);
  }

  int size_, below_ = 0, above_ = 0, pitch_ = 1;
  std::vector<int> order_, pivots_;
  std::vector<double> numbers_, part_;
  std::vector<std::size_t> targets_;
};

// The pattern with its diagonal, in Eigen's format.
SparseMatrix<double> pattern_of(const Sparsity& sparsity) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int column = 0; column < sparsity.size(); ++column) {
    entries.emplace_back(column, column, 0);
    for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
      entries.emplace_back(sparsity.row(k), column, 0);
  }
  SparseMatrix<double> matrix(sparsity.size(), sparsity.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  matrix.makeCompressed();
  return matrix;
}

class SparseFactors final : public MatrixSolver {
 public:
  explicit SparseFactors(const Sparsity& sparsity)
      : matrix_(pattern_of(sparsity)), right_(sparsity.size()), solution_(sparsity.size()) {
    const auto place = [&](int row, int column) {
      const int* const rows = matrix_.innerIndexPtr();
      return static_cast<std::size_t>(std::lower_bound(rows + matrix_.outerIndexPtr()[column],
                                                       rows + matrix_.outerIndexPtr()[column + 1],
                                                       row) -
                                      rows);
    };
    for (int column = 0; column < sparsity.size(); ++column) {
      diagonal_.push_back(place(column, column));
      for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
        targets_.push_back(place(sparsity.row(k), column));
    }
    lu_.analyzePattern(matrix_);
  }

  bool factorise(double tau, std::span<const double> values) override {
    double* const numbers = matrix_.valuePtr();
    std::fill_n(numbers, matrix_.nonZeros(), 0.0);
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (!std::isfinite(values[k])) return false;
      numbers[targets_[k]] = -tau * values[k];
    }
    for (const std::size_t k : diagonal_) numbers[k] += 1;
    lu_.factorize(matrix_);
    return lu_.info() == Eigen::Success;
  }

  void solve(double* x) override {
    right_ = Eigen::Map<const Eigen::VectorXd>(x, right_.size());
    solution_ = lu_.solve(right_);
    std::copy_n(solution_.data(), solution_.size(), x);
  }

  std::string name() const override { return "sparse"; }

 private:
  SparseMatrix<double> matrix_;
  std::vector<std::size_t> targets_, diagonal_;
  Eigen::SparseLU<SparseMatrix<double>, Eigen::COLAMDOrdering<int>> lu_;
  Eigen::VectorXd right_, solution_;
};

// The operations of a sparse factorisation, estimated from the fill-in of the symmetric one with
// these entries.
double sparse_operations(const Sparsity& sparsity) {
  const SparseMatrix<double> one = pattern_of(sparsity);
  SparseMatrix<double> both = SparseMatrix<double>(one.transpose()) + one;
  Eigen::SimplicialLDLT<SparseMatrix<double>> factors;
  factors.analyzePattern(both);
  const int* const begin = factors.matrixL().nestedExpression().outerIndexPtr();
  double sum = 0;
  for (int column = 0; column < sparsity.size(); ++column) {
    const double count = begin[column + 1] - begin[column];
    sum += 2 * count * count + 2 * count;
  }
  return sum;
}

double dense_operations(const std::vector<std::vector<int>>& groups) {
  double sum = 0;
  for (const std::vector<int>& group : groups) {
    const auto n = static_cast<double>(group.size());
    sum += 2 * n * n * n / 3;
  }
  return sum;
}

}  // namespace

std::unique_ptr<MatrixSolver> make_matrix_solver(const Sparsity& sparsity) {
  // A dense row is processed in vectors; a sparse column has to be found, which costs as much as
  // kColumn operations.
  constexpr double kDense = 0.4, kSparse = 3, kColumn = 200, kMostDense = 4e9;
  const auto joined = neighbours_of(sparsity);
  auto groups = groups_of(joined);
  const double dense = kDense * dense_operations(groups);
  if (sparsity.size() <= 4) return std::make_unique<DenseBlocks>(sparsity, std::move(groups));

  std::vector<int> order;
  double band = width_of(sparsity, order).operations(sparsity.size());
  if (auto narrow = narrow_order(joined);
      width_of(sparsity, narrow).operations(sparsity.size()) < 0.8 * band) {
    order = std::move(narrow);
    band = width_of(sparsity, order).operations(sparsity.size());
  }
  if (dense <= band && dense <= kMostDense)
    return std::make_unique<DenseBlocks>(sparsity, std::move(groups));
  const double sparse = kSparse * sparse_operations(sparsity) + kColumn * sparsity.size();
  if (band <= sparse) return std::make_unique<Band>(sparsity, std::move(order));
  return std::make_unique<SparseFactors>(sparsity);
}

}  // namespace sim
