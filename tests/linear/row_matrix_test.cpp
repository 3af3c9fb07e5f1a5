// The matrix of multipliers against dense algebra.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>

#include "core/linear/row_matrix.h"

namespace {

struct Rows {
  sim::RowPattern pattern;
  std::vector<sim::Vec3> gradient;
  std::vector<double> weights;

  Eigen::MatrixXd jacobian() const {
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(pattern.rows(), 3 * Eigen::Index(weights.size()));
    for (int r = 0; r < pattern.rows(); ++r)
      for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e)
        for (int axis = 0; axis < 3; ++axis) j(r, 3 * pattern.ids[e] + axis) += gradient[e][axis];
    return j;
  }
  Eigen::MatrixXd dense() const {
    Eigen::VectorXd w(3 * Eigen::Index(weights.size()));
    for (Eigen::Index i = 0; i < w.size(); ++i) w[i] = weights[i / 3];
    return jacobian() * w.asDiagonal() * jacobian().transpose();
  }
};

// Random rods and triples among n particles, some of them pinned.
Rows random_rows(int n, int rods, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> any(0, n - 1);
  std::normal_distribution<double> number;
  Rows rows;
  for (int i = 0; i < n; ++i) rows.weights.push_back(i % 7 == 3 ? 0 : std::exp(number(random)));
  while (rows.pattern.rows() < rods) {
    const int a = any(random), b = any(random), c = any(random);
    if (a == b || b == c || a == c) continue;
    if (rows.pattern.rows() % 5 == 0)
      rows.pattern.add({a, b, c});
    else
      rows.pattern.add({a, b});
  }
  for (std::size_t e = 0; e < rows.pattern.ids.size(); ++e)
    rows.gradient.emplace_back(number(random), number(random), number(random));
  return rows;
}

double error(const Rows& rows, const Eigen::VectorXd& expected, const Eigen::VectorXd& b) {
  sim::RowMatrix matrix(rows.pattern, rows.weights);
  Eigen::VectorXd x = b;
  matrix.factorise(rows.gradient, rows.weights);
  matrix.solve(x.data());
  return (x - expected).norm() / expected.norm();
}

}  // namespace

TEST_CASE("multipliers solve J W J^T lambda = b") {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Rows rows = random_rows(60, 70, seed);
    const Eigen::VectorXd b = Eigen::VectorXd::Random(70);
    const Eigen::VectorXd x = rows.dense().ldlt().solve(b);
    CHECK(error(rows, x, b) < 1e-10);
  }
}

TEST_CASE("a chain has no fill") {
  Rows rows;
  for (int i = 0; i < 1000; ++i) rows.pattern.add({i, i + 1});
  rows.weights.assign(1001, 1);
  CHECK(sim::RowMatrix(rows.pattern, rows.weights).fill() == 999);
}

TEST_CASE("rows that depend on each other get the multipliers of least norm") {
  Rows rows;
  std::mt19937 random(5);
  std::normal_distribution<double> number;
  rows.weights.assign(4, 2);
  // A flat square with both diagonals, and one of its sides twice.
  const sim::Vec3 corners[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const int rods[][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}, {1, 3}, {0, 1}};
  for (const auto& [a, b] : rods) {
    rows.pattern.add({a, b});
    const sim::Vec3 d = (corners[a] - corners[b]).normalized();
    rows.gradient.insert(rows.gradient.end(), {d, -d});
  }
  const Eigen::MatrixXd a = rows.dense();
  const Eigen::VectorXd b = a * Eigen::VectorXd::Random(a.rows());
  const Eigen::VectorXd x = a.completeOrthogonalDecomposition().solve(b);
  CHECK(error(rows, x, b) < 1e-6);
  sim::RowMatrix matrix(rows.pattern, rows.weights);
  matrix.factorise(rows.gradient, rows.weights);
  CHECK(matrix.dependent() == 2);
}

TEST_CASE("rows in which nothing can move have no multiplier") {
  Rows rows = random_rows(20, 10, 7);
  rows.weights.assign(20, 0);
  sim::RowMatrix matrix(rows.pattern, rows.weights);
  matrix.factorise(rows.gradient, rows.weights);
  std::vector<double> x(10, 1);
  matrix.solve(x.data());
  CHECK(x == std::vector<double>(10, 0));
}
