// Factors of sparse symmetric matrices against dense ones of Eigen.
#include "core/linear/sparse.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cstring>
#include <random>

#include "core/simd/simd_targets.h"

using namespace sim;

namespace {

using Pairs = std::vector<std::pair<int, int>>;

// A matrix at random with a dense copy; definite, or with negative eigenvalues as well.
struct Case {
  SparseSymmetric sparse;
  Eigen::MatrixXd dense;
};

Case make_case(int rows, const Pairs& upper, bool definite, std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  Case made{SparseSymmetric(rows, upper), Eigen::MatrixXd::Zero(rows, rows)};
  for (const auto& [row, column] : upper)
    if (row != column) made.dense(row, column) = made.dense(column, row) = number(random);
  for (int i = 0; i < rows; ++i) {
    const double sum = made.dense.row(i).cwiseAbs().sum() + 0.5;
    made.dense(i, i) = definite || i % 3 ? sum : -sum;
  }
  for (const auto& [row, column] : upper)
    made.sparse.values()[static_cast<std::size_t>(made.sparse.entry(row, column))] =
        made.dense(row, column);
  return made;
}

Pairs with_diagonal(int rows) {
  Pairs all;
  for (int i = 0; i < rows; ++i) all.emplace_back(i, i);
  return all;
}

Pairs scattered(int rows, int entries, std::mt19937& random) {
  Pairs all = with_diagonal(rows);
  for (int i = 0; i < entries && rows > 1; ++i) {
    const auto a = static_cast<int>(random() % static_cast<unsigned>(rows)),
               b = static_cast<int>(random() % static_cast<unsigned>(rows));
    all.emplace_back(std::min(a, b), std::max(a, b));
  }
  return all;
}

// Nodes of three rows on a grid, all rows of neighbours coupled.
Pairs grid(int a, int b, std::vector<int> (*order)(int, BlockPairs)) {
  std::vector<std::array<int, 2>> neighbours;
  for (int i = 0; i < a; ++i)
    for (int j = 0; j < b; ++j) {
      if (i + 1 < a) neighbours.push_back({i * b + j, (i + 1) * b + j});
      if (j + 1 < b) neighbours.push_back({i * b + j, i * b + j + 1});
      if (i + 1 < a && j + 1 < b) neighbours.push_back({i * b + j, (i + 1) * b + j + 1});
    }
  const std::vector<int> place = order(a * b, neighbours);
  Pairs all;
  const auto add = [&](int from, int to) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        const int row = 3 * place[static_cast<std::size_t>(from)] + r,
                  column = 3 * place[static_cast<std::size_t>(to)] + c;
        if (row <= column) all.emplace_back(row, column);
        if (row > column && from != to) all.emplace_back(column, row);
      }
  };
  for (int i = 0; i < a * b; ++i) add(i, i);
  for (const auto& [i, j] : neighbours) add(i, j);
  return all;
}

std::vector<int> as_they_are(int nodes, BlockPairs) {
  std::vector<int> place(static_cast<std::size_t>(nodes));
  for (int i = 0; i < nodes; ++i) place[static_cast<std::size_t>(i)] = i;
  return place;
}

void check_case(int rows, const Pairs& upper, bool definite, std::mt19937& random) {
  Case made = make_case(rows, upper, definite, random);
  CAPTURE(rows, upper.size(), definite);
  REQUIRE((definite ? made.sparse.factorise() : made.sparse.factorise_indefinite()));
  const int negative = definite ? 0 : (rows + 2) / 3;
  CHECK(made.sparse.negative_pivots() == negative);
  CHECK((definite || rows == 0 || !made.sparse.factorise()));
  if (!definite) REQUIRE(made.sparse.factorise_indefinite());
  Eigen::VectorXd x = Eigen::VectorXd::Random(rows);
  const Eigen::VectorXd b = made.dense * x;
  Eigen::VectorXd found = b;
  made.sparse.solve({found.data(), static_cast<std::size_t>(rows)});
  CHECK((found - x).lpNorm<Eigen::Infinity>() < 1e-11);
  // A second factorisation begins anew.
  REQUIRE((definite ? made.sparse.factorise() : made.sparse.factorise_indefinite()));
  Eigen::VectorXd again = b;
  made.sparse.solve({again.data(), static_cast<std::size_t>(rows)});
  CHECK(again == found);
}

}  // namespace

TEST_CASE("sparse matrices of all shapes are solved to rounding") {
  std::mt19937 random(5);
  for (const bool definite : {true, false}) {
    for (const int rows : {1, 2, 3, 5, 9, 40, 130})
      for (const int entries : {0, 1, 3, 10})
        check_case(rows, scattered(rows, rows * entries / 2, random), definite, random);
    // A dense matrix is several panels; chains and combs have many narrow ones.
    for (const int rows : {7, 47, 48, 49, 100, 200}) {
      Pairs dense;
      for (int i = 0; i < rows; ++i)
        for (int j = i; j < rows; ++j) dense.emplace_back(i, j);
      check_case(rows, dense, definite, random);
    }
    Pairs chain = with_diagonal(300), comb = with_diagonal(300), band = with_diagonal(300);
    for (int i = 0; i + 1 < 300; ++i) chain.emplace_back(i, i + 1);
    for (int i = 0; i + 1 < 300; ++i) comb.emplace_back(i, i % 7 ? i / 7 * 7 + 7 : i + 1);
    for (Pairs* const each : {&comb})
      std::erase_if(*each, [](const auto& entry) { return entry.second >= 300; });
    for (int i = 0; i + 9 < 300; ++i)
      for (int k = 1; k < 10; ++k) band.emplace_back(i, i + k);
    for (const Pairs* const each : {&chain, &comb, &band}) check_case(300, *each, definite, random);
    for (const auto& [a, b] : {std::pair{1, 30}, {6, 5}, {14, 15}}) {
      check_case(3 * a * b, grid(a, b, little_fill), definite, random);
      check_case(3 * a * b, grid(a, b, as_they_are), definite, random);
    }
  }
}

TEST_CASE("a matrix that is not definite, or has a pivot that is 0 or not finite, is refused") {
  const Pairs upper = {{0, 0}, {0, 1}, {1, 1}, {2, 2}};
  SparseSymmetric matrix(3, upper);
  const auto set = [&](double a, double b, double c, double d) {
    const double values[] = {a, b, c, d};
    for (std::size_t i = 0; i < upper.size(); ++i)
      matrix.values()[static_cast<std::size_t>(matrix.entry(upper[i].first, upper[i].second))] =
          values[i];
  };
  set(2, 1, 2, 1);
  CHECK(matrix.factorise());
  set(1, 2, 1, 1);
  CHECK_FALSE(matrix.factorise());
  CHECK(matrix.factorise_indefinite());
  CHECK(matrix.negative_pivots() == 1);
  set(1, 1, 1, 1);
  CHECK_FALSE(matrix.factorise_indefinite());
  set(1, 0, 1, std::nan(""));
  CHECK_FALSE(matrix.factorise_indefinite());
  set(1, INFINITY, 1, 1);
  CHECK_FALSE(matrix.factorise_indefinite());
  SparseSymmetric none(0, {});
  CHECK(none.factorise());
  none.solve({});
}

TEST_CASE("factors have the same bits with every instruction set") {
  const char* const before = std::getenv("SIM_SIMD");
  const std::string kept = before ? before : "";
  std::vector<std::vector<double>> results;
  for (const SimdLevel level : simd_levels()) {
    setenv("SIM_SIMD", simd_name(level), 1);
    std::mt19937 random(8);
    Case made = make_case(3 * 9 * 11, grid(9, 11, little_fill), false, random);
    REQUIRE(made.sparse.factorise_indefinite());
    std::vector<double> x(3 * 9 * 11);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(static_cast<double>(i));
    made.sparse.solve(x);
    results.push_back(x);
  }
  before ? setenv("SIM_SIMD", kept.c_str(), 1) : unsetenv("SIM_SIMD");
  for (const auto& each : results)
    CHECK(std::memcmp(each.data(), results[0].data(), each.size() * sizeof(double)) == 0);
}
