// Linear equations with sparse matrices, and where the entries of a Jacobian stand.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/noise.h"
#include "core/base/slot.h"
#include "core/ode/implicit/jacobian_entries.h"
#include "core/ode/implicit/matrix_solver.h"
#include "core/ode/ode_system.h"

using namespace sim;

namespace {

using Entries = std::vector<std::pair<int, int>>;

// Solves with random numbers in those places; the largest number of (I - tau J) x - b over that of
// x.
double residual(const Sparsity& sparsity, MatrixSolver& solver) {
  constexpr double kTau = 0.7;
  Noise noise;
  const auto n = static_cast<std::size_t>(sparsity.size());
  std::vector<double> values(sparsity.count()), right(n), x;
  for (double& value : values) value = 8 * noise.next();
  for (double& value : right) value = noise.next();
  REQUIRE(solver.factorise(kTau, values));
  x = right;
  solver.solve(x.data());
  std::vector<double> rest(n);
  for (std::size_t i = 0; i < n; ++i) rest[i] = x[i] - right[i];
  for (int column = 0; column < sparsity.size(); ++column)
    for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
      rest[static_cast<std::size_t>(sparsity.row(k))] -=
          kTau * values[static_cast<std::size_t>(k)] * x[static_cast<std::size_t>(column)];
  double most = 0, largest = 1;
  for (std::size_t i = 0; i < n; ++i) {
    most = std::max(most, std::fabs(rest[i]));
    largest = std::max(largest, std::fabs(x[i]));
  }
  return most / largest;
}

void check_solver(int size, const Entries& entries, const std::string& name) {
  const Sparsity sparsity(size, entries);
  const auto solver = make_matrix_solver(sparsity);
  CHECK(solver->name() == name);
  CHECK(residual(sparsity, *solver) < 1e-11);
}

Entries band(int size, int below, int above) {
  Entries entries;
  for (int column = 0; column < size; ++column)
    for (int row = std::max(0, column - above); row <= std::min(size - 1, column + below); ++row)
      entries.emplace_back(column, row);
  return entries;
}

Entries five_points(int side) {
  Entries entries;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      for (const auto& [a, b] : Entries{{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}})
        if (i + a >= 0 && i + a < side && j + b >= 0 && j + b < side)
          entries.emplace_back(i * side + j, (i + a) * side + j + b);
  return entries;
}

// A lattice of chains with one far neighbour, as a system that knows nothing of itself.
class Chain final : public OdeSystem {
 public:
  Chain(std::size_t size, bool late) : size_(size), late_(late) {}
  std::size_t size() const noexcept override { return size_; }
  void eval(double, const Stage& stage, double* y, double* dydt) override {
    combine(stage, y);
    for (std::size_t i = 0; i < size_; ++i) {
      const double left = i > 0 ? y[i - 1] : 0, far = y[(i + 7) % size_];
      dydt[i] = left * y[i] - 3 * y[i] + (late_ && y[0] < 5 ? 0 : far * far);
    }
    ++evaluations;
  }
  void combine(const Stage& stage, double* out) override {
    for (std::size_t i = 0; i < size_; ++i) {
      double sum = stage.x[i];
      for (const auto& term : stage.terms) sum += term.coef * term.k[i];
      out[i] = sum;
    }
  }
  int evaluations = 0;

 private:
  std::size_t size_;
  bool late_;
};

Sparsity chain_sparsity(int size, bool far) {
  Entries entries;
  for (int row = 0; row < size; ++row) {
    entries.emplace_back(row, row);
    if (row > 0) entries.emplace_back(row - 1, row);
    if (far) entries.emplace_back((row + 7) % size, row);
  }
  return Sparsity(size, entries);
}

}  // namespace

TEST_CASE("linear equations are solved in blocks, a band or sparsely, by what costs least") {
  check_solver(3, band(3, 2, 2), "dense");
  check_solver(40, band(40, 39, 39), "dense");
  check_solver(300, band(300, 1, 2), "band 1 + 2");
  check_solver(300, band(300, 2, 1), "band 1 + 2");  // in reverse
  check_solver(300, band(300, 0, 3), "band 0 + 3");
  check_solver(2500, five_points(50), "sparse");
  Entries blocks;
  for (int i = 0; i < 99; ++i)
    for (int j = 0; j < 3; ++j) blocks.emplace_back(i, (i % 33) + 33 * j);
  check_solver(99, blocks, "33 blocks");
  // A band, with its unknowns in another order.
  Entries mixed = band(301, 2, 2);
  for (auto& [column, row] : mixed) {
    column = column * 100 % 301;
    row = row * 100 % 301;
  }
  const Sparsity sparsity(301, mixed);
  const auto solver = make_matrix_solver(sparsity);
  CHECK(solver->name().starts_with("band"));
  CHECK(residual(sparsity, *solver) < 1e-11);
}

// Small blocks stay in registers; larger ones do not. Rows are exchanged: the largest entries of a
// block are not on its diagonal.
TEST_CASE("blocks of one to seven unknowns are solved") {
  for (int n = 1; n <= 7; ++n) {
    CAPTURE(n);
    Entries blocks;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (int block = 0; block < 2; ++block)
          blocks.emplace_back(2 * i + block, 2 * j + (n > 1 ? block : 0));
    if (n == 1) blocks = {{0, 0}, {1, 1}};
    const Sparsity sparsity(2 * n, blocks);
    const auto solver = make_matrix_solver(sparsity);
    CHECK(solver->name() == "2 blocks");
    std::vector<double> values(sparsity.count()), x(slot(2 * n)), right(slot(2 * n), 0);
    for (int turn = 0; turn < 5; ++turn) {
      const double tau = 0.5 + turn;
      for (int column = 0; column < 2 * n; ++column)
        for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k) {
          const int row = sparsity.row(k);
          values[slot(k)] = std::sin(1.0 + column + 7 * row + 3 * turn) +
                            (column / 2 == (row / 2 + turn) % n ? 9.0 : 0.0);
        }
      for (int i = 0; i < 2 * n; ++i) x[slot(i)] = std::cos(1.3 * i + turn);
      right = x;  // (I - tau J) x
      for (int column = 0; column < 2 * n; ++column)
        for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
          right[slot(sparsity.row(k))] -= tau * values[slot(k)] * x[slot(column)];
      REQUIRE(solver->factorise(tau, values));
      solver->solve(right.data());
      for (int i = 0; i < 2 * n; ++i)
        CHECK(right[slot(i)] == Approx(x[slot(i)]).epsilon(1e-9).margin(1e-11));
    }
  }
}

TEST_CASE("singular matrices are told") {
  for (const int size : {3, 300}) {
    const Sparsity sparsity(size, band(size, 1, 1));
    const auto solver = make_matrix_solver(sparsity);
    std::vector<double> values(sparsity.count(), 0);
    values[static_cast<std::size_t>(sparsity.find(1, 1))] = 4;
    CHECK_FALSE(solver->factorise(0.25, values));
    CHECK(solver->factorise(0.5, values));
    values[0] = std::nan("");
    CHECK_FALSE(solver->factorise(0.5, values));
  }
}

// One of several blocks is singular, each in turn.
TEST_CASE("a singular block is told whichever it is") {
  constexpr int kBlocks = 5, kSize = 3;
  Entries entries;
  for (int i = 0; i < kBlocks * kSize; ++i)
    for (int j = 0; j < kSize; ++j) entries.emplace_back(i, i / kSize * kSize + j);
  const Sparsity sparsity(kBlocks * kSize, entries);
  const auto solver = make_matrix_solver(sparsity);
  REQUIRE(solver->name() == "5 blocks");
  for (int block = 0; block < kBlocks; ++block) {
    std::vector<double> values(sparsity.count(), 0);
    CHECK(solver->factorise(0.25, values));
    values[static_cast<std::size_t>(sparsity.find(block * kSize + 1, block * kSize + 1))] = 4;
    CHECK_FALSE(solver->factorise(0.25, values));
  }
}

TEST_CASE("columns that share no row have one color") {
  const Sparsity sparsity(300, band(300, 2, 1));
  std::vector<int> colors(300);
  CHECK(color_columns(sparsity, colors) == 4);
  for (int a = 0; a < 300; ++a)
    for (int b = a + 1; b < std::min(300, a + 4); ++b)
      CHECK(colors[static_cast<std::size_t>(a)] != colors[static_cast<std::size_t>(b)]);
}

TEST_CASE("where a Jacobian has entries is found by asking, in few evaluations") {
  Chain chain(500, false);
  // A state of zeros: products vanish there, and so do their derivatives.
  const std::vector<double> zeros(500, 0);
  const auto entries = difference_entries(chain, 0, zeros.data());
  CHECK(entries->sparsity() == chain_sparsity(500, true));
  CHECK(chain.evaluations < 150);
  CHECK(entries->evaluations() == chain.evaluations);

  std::vector<double> x(500), values(entries->sparsity().count());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(static_cast<double>(i)) + 2;
  entries->at(0, x.data(), values);
  bool near = true;
  const Sparsity& sparsity = entries->sparsity();
  for (int column = 0; column < 500; ++column)
    for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k) {
      const auto row = static_cast<std::size_t>(sparsity.row(k)),
                 from = static_cast<std::size_t>(column);
      double exact = 0;
      if (from == row) exact += (row > 0 ? x[row - 1] : 0) - 3;
      if (from + 1 == row) exact += x[row];
      if (from == (row + 7) % 500) exact += 2 * x[from];
      near &= std::fabs(values[static_cast<std::size_t>(k)] - exact) < 1e-5;
    }
  CHECK(near);
}

TEST_CASE("entries that appear later are found when it is asked again") {
  Chain chain(60, true);
  std::vector<double> x(60, 1);
  const auto entries = difference_entries(chain, 0, x.data());
  CHECK(entries->sparsity() == chain_sparsity(60, false));
  CHECK_FALSE(entries->look_again(0, x.data()));
  x[0] = 9;
  CHECK(entries->look_again(0, x.data()));
  CHECK(entries->sparsity() == chain_sparsity(60, true));
}
