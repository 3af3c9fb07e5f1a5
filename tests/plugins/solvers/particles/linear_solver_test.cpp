// Solvers of equations with matrices of blocks against dense algebra.
#include "plugins/solvers/particles/linear_solver.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <random>

namespace {

using sim::Layout;
using sim::LinearResult;
using sim::Mat3;

// A matrix as a table. Half of its pairs of nodes are fixed ones, whose blocks are symmetric.
class Dense final : public sim::BlockMatrix {
 public:
  Dense(Eigen::MatrixXd a, std::vector<double> masses)
      : a_(std::move(a)), masses_(std::move(masses)), layout_(nodes(), 3) {
    for (int i = 0; i < nodes(); ++i)
      for (int j = i + 1; j < nodes(); ++j)
        if (block(i, j) != Mat3::Zero() || block(j, i) != Mat3::Zero())
          (is_fixed(i, j) ? fixed_ : others_).push_back({i, j});
  }

  const Layout& layout() const noexcept override { return layout_; }
  bool stopped() const override { return asked_++ >= most; }
  bool restricted() const noexcept override { return is_restricted; }
  double stiffness_ratio() const override { return 100; }

  double apply(const double* p, double* out) override {
    const Eigen::VectorXd from = vector(p), to = a_ * from;
    put(to, out);
    return from.dot(to);
  }
  double precondition(const double* r, double* z) override {
    Eigen::VectorXd from = vector(r), to = from;
    for (int i = 0; i < nodes(); ++i)
      to.segment<3>(3 * i) =
          free(i) ? Eigen::Vector3d(a_.block<3, 3>(3 * i, 3 * i).inverse() * from.segment<3>(3 * i))
                  : Eigen::Vector3d::Zero();
    put(to, z);
    return from.dot(to);
  }
  double turn_and_apply(double beta, const double* z, double* p, double* out) override {
    put(vector(z) + beta * vector(p), p);
    return apply(p, out);
  }
  double advance(double alpha, const double* p, const double* ap, double* d, double* r,
                 double* z) override {
    put(vector(d) + alpha * vector(p), d);
    put(vector(r) - alpha * vector(ap), r);
    return precondition(r, z);
  }
  Mat3 diagonal(int i) const override { return block(i, i); }
  std::vector<std::array<int, 2>> fixed_pairs() const override { return fixed_; }
  void for_each_pair(const VisitPair& fixed, const VisitPair& other) const override {
    for (const auto& [a, b] : fixed_) fixed(a, b, block(a, b));
    for (const auto& [a, b] : others_) {
      other(a, b, 0.5 * block(a, b));
      other(b, a, 0.5 * block(b, a));
    }
  }

  static bool is_fixed(int i, int j) { return (i + j) % 2 == 0; }
  int nodes() const { return static_cast<int>(masses_.size()); }
  bool free(int i) const { return masses_[static_cast<std::size_t>(i)] < HUGE_VAL; }
  const Eigen::MatrixXd& table() const { return a_; }
  const std::vector<double>& masses() const { return masses_; }
  std::vector<std::array<int, 2>> pairs() const {
    std::vector<std::array<int, 2>> all = fixed_;
    all.insert(all.end(), others_.begin(), others_.end());
    return all;
  }
  Eigen::VectorXd vector(const double* from) const {
    Eigen::VectorXd v(3 * nodes());
    for (int i = 0; i < nodes(); ++i)
      for (int axis = 0; axis < 3; ++axis) v[3 * i + axis] = layout_.axes(from)[axis][i];
    return v;
  }
  void put(const Eigen::VectorXd& v, double* to) const {
    for (int i = 0; i < nodes(); ++i)
      for (int axis = 0; axis < 3; ++axis) layout_.axes(to)[axis][i] = v[3 * i + axis];
  }

  bool is_restricted = false;
  int most = 1 << 30;  // questions until told to stop

 private:
  Mat3 block(int i, int j) const {
    Mat3 m = Mat3::Zero();
    for (int row = 0; row < 3; ++row)
      for (int col = 0; col < 3; ++col) m(row, col) = a_(3 * i + row, 3 * j + col);
    return m;
  }

  Eigen::MatrixXd a_;
  std::vector<double> masses_;
  Layout layout_;
  std::vector<std::array<int, 2>> fixed_, others_;
  mutable int asked_ = 0;
};

// Random, with some pairs of nodes that are not coupled. Fixed nodes have unit blocks alone.
Dense random_matrix(int nodes, bool symmetric, double lift, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> number;
  std::vector<double> masses;
  for (int i = 0; i < nodes; ++i) masses.push_back(i % 5 == 3 ? HUGE_VAL : 1);
  Eigen::MatrixXd a = Eigen::MatrixXd::NullaryExpr(
      3 * nodes, 3 * nodes, [&](Eigen::Index, Eigen::Index) { return number(random); });
  if (symmetric) a = (a + a.transpose()).eval();
  for (int i = 0; i < nodes; ++i)
    for (int j = 0; j < nodes; ++j)
      if (masses[static_cast<std::size_t>(i)] == HUGE_VAL ||
          masses[static_cast<std::size_t>(j)] == HUGE_VAL || (i != j && (i * j + i + j) % 3 == 1))
        a.block<3, 3>(3 * i, 3 * j).setZero();
  for (int i = 0; i < 3 * nodes; ++i)
    a(i, i) = masses[static_cast<std::size_t>(i / 3)] == HUGE_VAL ? 1 : a(i, i) + lift;
  for (int i = 0; symmetric && i < nodes; ++i)
    for (int j = 0; j < nodes; ++j)
      if (i != j && Dense::is_fixed(i, j)) {
        const Eigen::Matrix3d block = a.block<3, 3>(3 * i, 3 * j);
        a.block<3, 3>(3 * i, 3 * j) = 0.5 * (block + block.transpose());
      }
  if (symmetric)  // the blocks D are positive, whatever A is
    for (int i = 0; i < nodes; ++i) {
      const Eigen::Matrix3d d = a.block<3, 3>(3 * i, 3 * i);
      a.block<3, 3>(3 * i, 3 * i) =
          d * d.transpose() / (1 + d.norm()) + Eigen::Matrix3d::Identity();
      if (lift > 0) a.block<3, 3>(3 * i, 3 * i) += lift * Eigen::Matrix3d::Identity();
    }
  return {std::move(a), std::move(masses)};
}

Eigen::VectorXd right_side(const Dense& matrix) {
  Eigen::VectorXd b(3 * matrix.nodes());
  for (int i = 0; i < b.size(); ++i) b[i] = matrix.free(i / 3) ? std::sin(3.0 * i + 1) : 0;
  return b;
}

struct Solved {
  LinearResult result;
  Eigen::VectorXd d;
  double rest;  // |b - A d| / |b|
};

Solved solved(sim::LinearSolver& solver, const Dense& matrix, double eta) {
  const Eigen::VectorXd b = right_side(matrix);
  sim::Array right(matrix.layout().size()), d(right.size());
  matrix.put(b, right.data());
  const LinearResult result = solver.solve(right.data(), d.data(), eta);
  const Eigen::VectorXd found = matrix.vector(d.data());
  return {result, found, (b - matrix.table() * found).norm() / b.norm()};
}

std::unique_ptr<sim::SparseLdlt> factors_of(const Dense& matrix) {
  return std::make_unique<sim::SparseLdlt>(matrix, matrix.pairs(),
                                           sim::elimination_rows(matrix.masses(), matrix.pairs()));
}

}  // namespace

// Conjugate gradients and GMRES end within as many iterations as there are unknowns.
TEST_CASE("solvers of block matrices solve to the accuracy asked for, at any size", "[linear]") {
  for (int nodes = 1; nodes <= 9; ++nodes) {
    CAPTURE(nodes);
    Dense positive = random_matrix(nodes, true, 12.0 * nodes, 3U + static_cast<unsigned>(nodes));
    REQUIRE(positive.table().llt().info() == Eigen::Success);
    const int unknowns =
        3 * nodes - 3 * static_cast<int>(std::ranges::count(positive.masses(), HUGE_VAL));
    for (const double eta : {0.1, 1e-9}) {
      sim::ConjugateGradient gradient(positive, unknowns + 5);
      const Solved by_gradient = solved(gradient, positive, eta);
      CHECK((by_gradient.result.solved && by_gradient.result.definite));
      CHECK(by_gradient.rest < 10 * eta);  // asked for in the norm of the blocks
      CHECK(by_gradient.result.iterations <= unknowns + 2);

      Dense any = random_matrix(nodes, false, 3.0 * nodes, 50U + static_cast<unsigned>(nodes));
      sim::Gmres gmres(any, unknowns + 1, nullptr, 1);
      const Solved by_gmres = solved(gmres, any, eta);
      CHECK(by_gmres.result.solved);
      CHECK(by_gmres.rest <= eta * (1 + 1e-6));
      CHECK(by_gmres.result.factorisations == 0);
    }
    const auto direct = factors_of(positive);
    const Solved exact = solved(*direct, positive, 1);
    CHECK(exact.result.definite);
    CHECK(exact.rest < 1e-13);
    for (int i = 0; i < nodes; ++i)
      if (!positive.free(i)) CHECK(exact.d.segment<3>(3 * i).norm() == 0);
  }
}

TEST_CASE("what is not positive definite is told, with a direction that goes down", "[linear]") {
  int told = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    CAPTURE(seed);
    Dense matrix = random_matrix(6, true, 0, seed);
    if (matrix.table().llt().info() == Eigen::Success) continue;
    ++told;
    CHECK_FALSE(solved(*factors_of(matrix), matrix, 1e-9).result.definite);
    sim::ConjugateGradient gradient(matrix, 100);
    const Solved found = solved(gradient, matrix, 1e-12);
    CHECK_FALSE(found.result.definite);
    REQUIRE(found.result.downward);
    const Eigen::VectorXd p = matrix.vector(found.result.downward);
    CHECK(p.dot(matrix.table() * p) <= 0);
  }
  CHECK(told > 6);
}

// One iteration is enough with the factors of a symmetric matrix itself.
TEST_CASE("GMRES takes the factors of stiff matrices that nothing restricts", "[linear]") {
  for (const double stiff : {99.0, 100.0, 101.0})
    for (const bool restricted : {false, true}) {
      CAPTURE(stiff, restricted);
      Dense matrix = random_matrix(7, true, 90, 5);
      matrix.is_restricted = restricted;
      sim::Gmres gmres(matrix, 60, factors_of(matrix), stiff);
      const Solved found = solved(gmres, matrix, 1e-9);
      const bool used = !restricted && stiff <= 100;
      CHECK(found.result.solved);
      CHECK(found.rest <= 1e-9);
      CHECK(found.result.factorisations == (used ? 1 : 0));
      CHECK((found.result.iterations == 1) == used);
    }
}

TEST_CASE("GMRES goes on after its 30 directions", "[linear]") {
  Dense matrix = random_matrix(24, false, 9, 8);
  sim::Gmres gmres(matrix, 400, nullptr, 1);
  const Solved found = solved(gmres, matrix, 1e-10);
  CHECK(found.result.solved);
  CHECK(found.result.iterations > 30);
  CHECK(found.rest <= 1.001e-10);
}

TEST_CASE("solvers stop when told to, and at their most iterations", "[linear]") {
  for (const int most : {0, 1, 4}) {
    CAPTURE(most);
    Dense matrix = random_matrix(8, true, 60, 2);
    sim::ConjugateGradient few(matrix, most);
    Solved found = solved(few, matrix, 1e-12);
    CHECK_FALSE(found.result.solved);
    CHECK(found.result.iterations == most);
    sim::Gmres few_too(matrix, most, nullptr, 1);
    found = solved(few_too, matrix, 1e-12);
    CHECK_FALSE(found.result.solved);
    CHECK(found.result.iterations == most);

    Dense halted = random_matrix(8, true, 60, 2);
    halted.most = most;
    sim::ConjugateGradient gradient(halted, 100);
    CHECK(solved(gradient, halted, 1e-12).result.iterations == most);
  }
}

// Without couplings a factor has one block a node; a chain from its end has two but at the last, in
// any order that little fill allows; where all are coupled, n - k of the k-th.
TEST_CASE("products of a factorisation are those of its columns", "[linear]") {
  for (int n = 1; n <= 12; ++n) {
    CAPTURE(n);
    std::vector<int> rows(static_cast<std::size_t>(n));
    std::iota(rows.begin(), rows.end(), 0);
    CHECK(sim::factor_products(rows, {}) == 27.0 * n);
    std::vector<std::array<int, 2>> chain, all;
    for (int i = 0; i + 1 < n; ++i) chain.push_back({i, i + 1});
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j) all.push_back({j, i});
    CHECK(sim::factor_products(rows, chain) == 27.0 * (4 * (n - 1) + 1));
    double squares = 0;
    for (int k = 1; k <= n; ++k) squares += k * k;
    CHECK(sim::factor_products(rows, all) == 27.0 * squares);

    // An order of little fill of a chain adds no fill at all; heavy nodes have no row.
    std::vector<double> masses(static_cast<std::size_t>(n), 1.0);
    std::vector<int> found = sim::elimination_rows(masses, chain);
    CHECK(sim::factor_products(found, chain) == 27.0 * (4 * (n - 1) + 1));
    masses[0] = HUGE_VAL;
    found = sim::elimination_rows(masses, chain);
    CHECK(found[0] == -1);
    std::ranges::sort(found);
    for (int k = 0; k < n; ++k) CHECK(found[static_cast<std::size_t>(k)] == k - 1);
  }
  CHECK(sim::factor_products(std::vector<int>{-1, -1}, {}) == 0);
}
