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

// Clusters of rods that share no particle, one of them with a rod given twice.
// Triads of nodes with three orthogonal rows each. The last triad has unequal weights, or a rod to
// the one before: its rows are not independent, and neither are those that the rod joins.
TEST_CASE("orthogonal rows are solved one by one where they are independent") {
  for (const bool joined : {false, true}) {
    CAPTURE(joined);
    constexpr int kTriads = 4;
    Rows rows;
    std::vector<std::uint8_t> orthogonal;
    for (int i = 0; i < 3 * kTriads; ++i)
      rows.weights.push_back(i / 3 == kTriads - 1 && !joined ? 1.0 + i : 2.0);
    const double signs[3][3] = {{1, 1, 1}, {1, -1, 0}, {1, 1, -2}};
    for (int triad = 0; triad < kTriads; ++triad)
      for (const auto& row : signs) {
        rows.pattern.add({3 * triad, 3 * triad + 1, 3 * triad + 2});
        orthogonal.push_back(1);
        for (const double sign : row)
          rows.gradient.push_back((1 + triad) * sign * sim::Vec3(0.3, -0.5, 0.1));
      }
    if (joined) {
      rows.pattern.add({3 * kTriads - 4, 3 * kTriads - 1});
      orthogonal.push_back(0);
      rows.gradient.emplace_back(1, 0, 0.5), rows.gradient.emplace_back(0, 2, -1);
    }
    sim::RowMatrix matrix(rows.pattern, rows.weights, orthogonal);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(rows.pattern.rows(), 1, 3);
    const Eigen::VectorXd expected = rows.dense().ldlt().solve(b);
    // Rows that are not obeyed are orthogonal no more: factorise() sees that.
    rows.gradient[0] += sim::Vec3(0, 0, 0.2);
    const Eigen::VectorXd other = rows.dense().ldlt().solve(b);
    Eigen::VectorXd x = b;
    matrix.factorise(rows.gradient, rows.weights);
    matrix.solve(x.data());
    CHECK((x - other).norm() < 1e-12 * other.norm());
    rows.gradient[0] -= sim::Vec3(0, 0, 0.2);
    for (int turn = 0; turn < 2; ++turn) {
      x = b;
      matrix.factorise_obeyed(rows.gradient, rows.weights);
      matrix.solve(x.data());
      CHECK((x - expected).norm() < 1e-12 * expected.norm());
    }
    rows.gradient[0] += sim::Vec3(0, 0, 0.2);
    x = b;
    matrix.factorise_obeyed(rows.gradient, rows.weights);
    matrix.solve(x.data());
    CHECK(std::fabs(x[1] - expected[1]) < 1e-12 * std::fabs(expected[1]));
    CHECK(std::fabs(x[1] - other[1]) > 1e-3 * std::fabs(other[1]));
    CHECK(matrix.dependent() == 0);
  }
}

TEST_CASE("separate rows have the same bits on any number of threads") {
  constexpr int kClusters = 200, kParticles = 12, kRods = 24;
  Rows all;
  std::vector<Rows> each;
  for (int k = 0; k < kClusters; ++k) {
    Rows one = random_rows(kParticles, kRods, static_cast<unsigned>(k + 1));
    if (k == 7) {
      const std::span<const int> last = one.pattern.of(kRods - 1);
      const std::vector<int> again(last.begin(), last.end());
      const auto begin = one.gradient.end() - static_cast<std::ptrdiff_t>(again.size());
      const std::vector<sim::Vec3> gradient(begin, one.gradient.end());
      one.pattern.ids.insert(one.pattern.ids.end(), again.begin(), again.end());
      one.pattern.begin.push_back(static_cast<int>(one.pattern.ids.size()));
      one.gradient.insert(one.gradient.end(), gradient.begin(), gradient.end());
    }
    const auto first = static_cast<int>(all.weights.size());
    for (int r = 0; r < one.pattern.rows(); ++r) {
      for (const int i : one.pattern.of(r)) all.pattern.ids.push_back(first + i);
      all.pattern.begin.push_back(static_cast<int>(all.pattern.ids.size()));
    }
    all.gradient.insert(all.gradient.end(), one.gradient.begin(), one.gradient.end());
    all.weights.insert(all.weights.end(), one.weights.begin(), one.weights.end());
    each.push_back(std::move(one));
  }
  std::vector<double> b;
  for (int r = 0; r < all.pattern.rows(); ++r) b.push_back(std::sin(r));

  std::vector<double> first;
  for (const int threads : {1, 2, 3}) {
    sim::ThreadPool pool(threads);
    sim::RowMatrix matrix(all.pattern, all.weights);
    matrix.share(&pool);
    matrix.factorise(all.gradient, all.weights);
    CHECK(matrix.fill() > 20'000);  // enough that threads share it
    std::vector<double> x = b;
    matrix.solve(x.data());
    if (threads == 1) first = x;
    CHECK(x == first);
  }
  std::size_t row = 0;
  for (const Rows& one : each) {
    const auto rows = static_cast<std::size_t>(one.pattern.rows());
    std::vector<double> x(b.begin() + static_cast<std::ptrdiff_t>(row),
                          b.begin() + static_cast<std::ptrdiff_t>(row + rows));
    sim::RowMatrix matrix(one.pattern, one.weights);
    matrix.factorise(one.gradient, one.weights);
    matrix.solve(x.data());
    // Each in its own order of elimination.
    for (std::size_t r = 0; r < rows; ++r)
      CHECK(first[row + r] == Approx(x[r]).epsilon(1e-6).margin(1e-6));
    row += rows;
  }
}

namespace {

// A net of n x n nodes with random gradients: its factors are panels from 24 x 24 on.
Rows net(int n) {
  std::mt19937 random(3);
  std::normal_distribution<double> number;
  Rows rows;
  for (int i = 0; i < n * n; ++i) rows.weights.push_back(1 + 0.5 * std::sin(i));
  for (int i = 0; i < n * n; ++i) {
    if (i % n + 1 < n) rows.pattern.add({i, i + 1});
    if (i / n + 1 < n) rows.pattern.add({i, i + n});
  }
  for (std::size_t e = 0; e < rows.pattern.ids.size(); ++e)
    rows.gradient.emplace_back(number(random), number(random), number(random));
  return rows;
}

}  // namespace

TEST_CASE("nets are solved in panels") {
  const int n = GENERATE(19, 24, 31);
  CAPTURE(n);
  Rows rows = net(n);
  Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(rows.pattern.rows(), -1, 2);
  CHECK(error(rows, rows.dense().ldlt().solve(b), b) < 1e-10);
  SECTION("rows in which nothing can move have no multiplier") {
    rows.gradient[0] = rows.gradient[1] = sim::Vec3::Zero();
    Eigen::MatrixXd a = rows.dense();
    a(0, 0) = 1;
    Eigen::VectorXd x = a.ldlt().solve(b);
    x[0] = 0;
    CHECK(error(rows, x, b) < 1e-10);
  }
  SECTION("rows that depend on each other get the multipliers of least norm") {
    for (const int r : {7, 300}) {
      const auto begin = static_cast<std::size_t>(rows.pattern.begin[r]);
      const std::vector<int> ids(rows.pattern.of(r).begin(), rows.pattern.of(r).end());
      rows.pattern.add({ids[0], ids[1]});
      const sim::Vec3 own[] = {rows.gradient[begin], rows.gradient[begin + 1]};
      rows.gradient.insert(rows.gradient.end(), {own[0], own[1]});
    }
    const Eigen::MatrixXd a = rows.dense();
    b = a * Eigen::VectorXd::LinSpaced(a.rows(), -1, 2);
    CHECK(error(rows, a.completeOrthogonalDecomposition().solve(b), b) < 1e-6);
    sim::RowMatrix matrix(rows.pattern, rows.weights);
    matrix.factorise(rows.gradient, rows.weights);
    CHECK(matrix.dependent() == 2);
    const int first = matrix.first_dependent(), last = rows.pattern.rows() - 1;
    CHECK((first == 7 || first == 300 || first == last || first == last - 1));
    rows.gradient.resize(rows.gradient.size() - 4, {});
    rows.gradient.insert(rows.gradient.end(), 4, {1, 2, 3});
    matrix.factorise(rows.gradient, rows.weights);
    CHECK(matrix.dependent() == 0);
    CHECK(matrix.first_dependent() == -1);
  }
  SECTION("a gradient that is not finite leaves no multiplier finite") {
    sim::RowMatrix matrix(rows.pattern, rows.weights);
    matrix.factorise(rows.gradient, rows.weights);
    rows.gradient[5] = {0, HUGE_VAL, 0};
    matrix.factorise(rows.gradient, rows.weights);
    matrix.solve(b.data());
    CHECK_FALSE(b.array().isFinite().any());
  }
}

TEST_CASE("rows may be cut where no node has rows on both sides", "[constraint]") {
  sim::RowPattern pattern;
  CHECK(pattern.cuts() == std::vector<int>{0});
  pattern.add({4, 5});  // a chain
  pattern.add({5, 2});
  pattern.add({0});  // alone
  pattern.add({7, 8});
  pattern.add({1});  // alone, but between rows of 8
  pattern.add({8, 3});
  pattern.add({3, 9});
  pattern.add({6});
  CHECK(pattern.cuts() == std::vector<int>{0, 2, 3, 7, 8});
}
