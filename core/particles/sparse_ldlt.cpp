#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cmath>

#include "core/particles/linear_solver.h"

namespace sim {

SparseLdlt::SparseLdlt(const StageMatrix& matrix, std::span<const double> masses) {
  // The order of elimination, found on the graph of particles rather than of their coordinates.
  std::vector<int> number(masses.size(), -1);
  int free = 0;
  for (std::size_t i = 0; i < masses.size(); ++i)
    if (masses[i] < HUGE_VAL) number[i] = free++;
  const auto each_pair = [&](const auto& visit) {
    matrix.stiffness().for_each([&](int a, int b, SpringStiffness) {
      visit(number[static_cast<std::size_t>(a)], number[static_cast<std::size_t>(b)]);
    });
  };
  std::vector<Eigen::Triplet<double>> entries;
  each_pair([&](int a, int b) {
    if (a < 0 || b < 0) return;
    entries.emplace_back(a, b, 1.0);
    entries.emplace_back(b, a, 1.0);
  });
  for (int i = 0; i < free; ++i) entries.emplace_back(i, i, 1.0);
  Matrix graph(free, free);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(graph, order);
  row_of_ = number;
  if (free > 0) {
    const Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> place = order.inverse();
    for (int& row : row_of_)
      if (row >= 0) row = 3 * place.indices()[row];
  }

  // The pattern of the upper half, in that order.
  entries.clear();
  const auto add_block = [&](int low, int high) {
    for (int row = 0; row < 3; ++row)
      for (int col = low == high ? row : 0; col < 3; ++col)
        entries.emplace_back(low + row, high + col, 0.0);
  };
  for (const int row : row_of_)
    if (row >= 0) add_block(row, row);
  matrix.stiffness().for_each([&](int a, int b, SpringStiffness) {
    const int low = row_of_[static_cast<std::size_t>(a)],
              high = row_of_[static_cast<std::size_t>(b)];
    if (low >= 0 && high >= 0) add_block(std::min(low, high), std::max(low, high));
  });
  upper_.resize(3 * free, 3 * free);
  upper_.setFromTriplets(entries.begin(), entries.end());
  upper_.makeCompressed();
  for (const int row : row_of_) diagonal_.push_back(row < 0 ? Target{} : target(row, row));
  matrix.stiffness().for_each([&](int a, int b, SpringStiffness) {
    const int low = row_of_[static_cast<std::size_t>(a)],
              high = row_of_[static_cast<std::size_t>(b)];
    springs_.push_back(low < 0 || high < 0 ? Target{}
                                           : target(std::min(low, high), std::max(low, high)));
  });
  ldlt_.analyzePattern(upper_);
  // The first factorisation takes the memory of all: that of I.
  for (std::size_t i = 0; i < row_of_.size(); ++i)
    for (int col = 0; col < 3; ++col)
      if (row_of_[i] >= 0) upper_.valuePtr()[diagonal_[i].column[col] + col] = 1;
  if (free > 0) ldlt_.factorise(upper_);
  x_.setZero(3 * free);
}

SparseLdlt::Target SparseLdlt::target(int low, int high) const {
  Target found{};
  for (int col = 0; col < 3; ++col) {
    const int* const begin = upper_.innerIndexPtr() + upper_.outerIndexPtr()[high + col];
    const int* const end = upper_.innerIndexPtr() + upper_.outerIndexPtr()[high + col + 1];
    found.column[col] =
        static_cast<int>(std::lower_bound(begin, end, low) - upper_.innerIndexPtr());
  }
  return found;
}

void SparseLdlt::assemble(const StageMatrix& matrix) {
  double* const values = upper_.valuePtr();
  std::fill_n(values, upper_.nonZeros(), 0.0);
  for (std::size_t i = 0; i < row_of_.size(); ++i) {
    if (row_of_[i] < 0) continue;
    const Mat3 block = matrix.diagonal(static_cast<int>(i));
    for (int col = 0; col < 3; ++col)
      for (int row = 0; row <= col; ++row) values[diagonal_[i].column[col] + row] = block(row, col);
  }
  const double scale = -matrix.tau() * matrix.tau();
  auto spring = springs_.begin();
  matrix.stiffness().for_each([&](int a, int b, SpringStiffness stiffness) {
    const Vec3 d = matrix.stiffness().position(a) - matrix.stiffness().position(b);
    const Target& at = *spring++;
    if (row_of_[static_cast<std::size_t>(a)] < 0 || row_of_[static_cast<std::size_t>(b)] < 0)
      return;
    for (int col = 0; col < 3; ++col)
      for (int row = 0; row < 3; ++row)
        values[at.column[col] + row] +=
            scale * (stiffness.across * d[row] * d[col] + (row == col ? stiffness.along : 0.0));
  });
}

LinearResult SparseLdlt::solve(StageMatrix& matrix, const double* b, double* d, double /*eta*/) {
  LinearResult result{.factorisations = 1};
  const Layout& layout = matrix.layout();
  std::fill_n(d, layout.size(), 0.0);
  if (x_.size() == 0) return result;
  assemble(matrix);
  if (!ldlt_.factorise(upper_)) {
    result.definite = false;
    return result;
  }
  const auto from = layout.axes(b);
  const auto to = layout.axes(d);
  for (int i = 0; i < layout.n(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (const int row = row_of_[static_cast<std::size_t>(i)]; row >= 0)
        x_[row + axis] = from[axis][i];
  ldlt_.solve_in_place(x_);
  for (int i = 0; i < layout.n(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (const int row = row_of_[static_cast<std::size_t>(i)]; row >= 0)
        to[axis][i] = x_[row + axis];
  return result;
}

}  // namespace sim
