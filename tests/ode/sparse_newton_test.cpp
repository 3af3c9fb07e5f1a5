// Stages of systems whose Jacobian is known by its entries: equations that are linear in the state.
#include "core/ode/implicit/sparse_newton.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "core/ode/ode_system.h"

using namespace sim;

namespace {

using Numbers = std::vector<double>;

constexpr int kSize = 4;

// x_i' = sum_j a_ij(t) x_j + sin(t + i), stiff, coupled to the next, and faster the later it is.
class Linear final : public OdeSystem {
 public:
  static double entry(double t, int row, int column) {
    if (row == column) return -(1 + t) * std::pow(10.0, row);
    return column == row + 1 ? 3 * std::cos(t) : 0;
  }
  std::size_t size() const noexcept override { return kSize; }
  void eval(double t, const Stage& stage, double* y, double* dydt) override {
    combine(stage, y);
    for (int i = 0; i < kSize; ++i) {
      dydt[i] = std::sin(t + i);
      for (int j = 0; j < kSize; ++j) dydt[i] += entry(t, i, j) * y[j];
    }
  }
  void combine(const Stage& stage, double* out) override {
    for (std::size_t i = 0; i < kSize; ++i) {
      out[i] = stage.x[i];
      for (const auto& term : stage.terms) out[i] += term.coef * term.k[i];
    }
  }
};

// Its Jacobian, which notes when it is asked for.
class Entries final : public JacobianEntries {
 public:
  explicit Entries(Numbers& times) : times_(times) {
    std::vector<std::pair<int, int>> places;  // column, row
    for (int row = 0; row < kSize; ++row)
      for (int column = row; column < std::min(kSize, row + 2); ++column)
        places.emplace_back(column, row);
    sparsity_ = Sparsity(kSize, places);
  }
  const Sparsity& sparsity() const override { return sparsity_; }
  void at(double t, const double* /*x*/, std::span<double> values) override {
    times_.push_back(t);
    for (int column = 0; column < kSize; ++column)
      for (int k = sparsity_.begin_of(column); k < sparsity_.end_of(column); ++k)
        values[static_cast<std::size_t>(k)] = Linear::entry(t, sparsity_.row(k), column);
  }

 private:
  Numbers& times_;
  Sparsity sparsity_;
};

struct Solver {
  explicit Solver(bool weights)
      : newton(system, weights ? StageOptions{.atol = 1e-8, .rtol = 1e-8} : StageOptions{},
               std::make_unique<Entries>(times)) {}
  Numbers solve(double t, double tau) {
    Numbers r(kSize), y(kSize, 0.0), guess(kSize), slope(kSize);
    for (int i = 0; i < kSize; ++i) r[static_cast<std::size_t>(i)] = std::cos(5 * t + i);
    REQUIRE(newton.solve(t, tau, r.data(), y.data()) == StepStatus::kDone);
    system.eval(t, {y.data(), {}}, guess.data(), slope.data());
    for (std::size_t i = 0; i < kSize; ++i)
      CHECK(y[i] == Approx(r[i] + tau * slope[i]).margin(1e-7 * (1 + tau * 2000)));
    return y;
  }

  Linear system;
  Numbers times;
  SparseNewton newton;
};

}  // namespace

// Newton's method solves a linear equation at once; to see it, weights take a second iteration.
TEST_CASE("a linear stage takes one Jacobian, at its time, and one factorisation") {
  for (const bool weights : {false, true})
    for (const double tau : {1e-4, 0.02, 3.0})
      for (const double t : {0.0, 0.7, 40.0}) {
        CAPTURE(weights, tau, t);
        Solver solver(weights);
        solver.solve(t, tau);
        CHECK(solver.times == Numbers{t});
        CHECK(solver.newton.effort().factorisations == 1);
        CHECK(solver.newton.effort().newton <= 2);
        // Nothing of that is done again for another right-hand side, nor a little later.
        solver.solve(t, tau);
        solver.solve(t + 1e-3, tau);
        CHECK(solver.times == Numbers{t});
        CHECK(solver.newton.effort().factorisations == 1);
        // A new factorisation suits another tau.
        solver.solve(t, 1.5 * tau);
        CHECK(solver.times == Numbers{t});
        CHECK(solver.newton.effort().factorisations == 2);
        solver.newton.restart();
        solver.solve(t + 1, tau);
        CHECK(solver.times == Numbers{t, t + 1});
      }
}

TEST_CASE("a stage goes on from the memory of another with the same bits") {
  for (const bool weights : {false, true}) {
    CAPTURE(weights);
    Solver one(weights), other(weights);
    CHECK(one.newton.memory().empty());
    one.solve(0.3, 0.05);
    one.solve(0.35, 0.05);
    const Numbers memory = one.newton.memory();
    REQUIRE_FALSE(memory.empty());
    other.newton.recall(memory);
    CHECK(other.times == Numbers{0.3});
    for (const double tau : {0.05, 0.055, 0.2}) CHECK(one.solve(0.4, tau) == other.solve(0.4, tau));
    // A memory that no solver has written is not taken.
    for (const Numbers& wrong :
         {Numbers{}, Numbers(memory.begin(), memory.end() - 1),
          Numbers(memory.size(), std::nan("")), Numbers(memory.size(), 0.0)}) {
      other.newton.recall(wrong);
      CHECK(other.newton.memory().empty());
    }
  }
}
