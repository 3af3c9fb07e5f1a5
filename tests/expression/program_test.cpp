// Compiled formulas: many elements at a time, registers, the same bits everywhere.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>

#include "core/base/error.h"
#include "core/simd/simd_targets.h"
#include "tests/expression/formula.h"

using sim_test::Formula;

namespace {

// The values of several nodes at `count` points.
std::vector<std::vector<double>> run(const Formula& formula, const std::vector<int>& nodes,
                                     int count) {
  const sim::Program program(formula.graph, nodes, 2);
  const auto size = static_cast<std::size_t>((count + 7) / 8 * 8);
  std::vector<double> x(size), y(size);
  for (std::size_t i = 0; i < size; ++i) {
    x[i] = 0.1 + 0.37 * static_cast<double>(i);
    y[i] = 2.0 - 0.11 * static_cast<double>(i);
  }
  std::vector<std::vector<double>> values(nodes.size(), std::vector<double>(size, -99));
  const double* const inputs[] = {x.data(), y.data()};
  std::vector<double*> outputs;
  for (auto& list : values) outputs.push_back(list.data());
  program.run(inputs, outputs.data(), count);
  for (auto& list : values) list.resize(static_cast<std::size_t>(count));
  return values;
}

constexpr const char* kAll =
    "exp(-x) + log(x)*sin(x*y) - cos(y)/tan(x) + sinh(x/9) + cosh(y/9)*tanh(x) + sqrt(x)*abs(y) + "
    "x^0.3 + min(x, y)*max(y, 1) + step(y)*sign(y) + floor(x) + select(step(y), x, y^3)";

}  // namespace

TEST_CASE("a program gives every element and every formula its value") {
  Formula formula(kAll);
  const int slope = formula.graph.derivative(formula.node, 0);
  const int x = formula.graph.input(0), five = formula.graph.number(5);
  // Formulas, the same one twice, an input and a constant.
  const std::vector<int> nodes = {formula.node, slope, formula.node, x, five};
  const auto values = run(formula, nodes, 150);
  for (int i : {0, 1, 7, 63, 64, 149}) {
    const auto at = static_cast<std::size_t>(i);
    const double xi = 0.1 + 0.37 * i, yi = 2.0 - 0.11 * i;
    INFO(i);
    CHECK(values[0][at] == formula(xi, yi));
    CHECK(values[1][at] == formula.at(slope, xi, yi));
    CHECK(values[2][at] == values[0][at]);
    CHECK(values[3][at] == xi);
    CHECK(values[4][at] == 5);
  }
}

TEST_CASE("formulas have the same bits with every instruction set") {
  const char* const before = std::getenv("SIM_SIMD");
  const std::string kept = before ? before : "";
  std::vector<std::vector<std::vector<double>>> results;
  for (const char* level : {"sse2", "fma", "avx2", "avx512"}) {
    setenv("SIM_SIMD", level, 1);
    Formula formula(kAll);
    results.push_back(run(formula, {formula.node, formula.graph.derivative(formula.node, 1)}, 100));
  }
  before ? setenv("SIM_SIMD", kept.c_str(), 1) : unsetenv("SIM_SIMD");
  for (const auto& result : results)
    for (std::size_t f = 0; f < result.size(); ++f)
      CHECK(std::memcmp(result[f].data(), results[0][f].data(), 100 * sizeof(double)) == 0);
}

TEST_CASE("formulas that need many registers are evaluated in smaller blocks") {
  // A sum of n products whose factors are all needed again, backwards.
  const auto deep = [](int n) {
    std::string text = "0";
    for (int i = 0; i < n; ++i) text += "+x" + std::to_string(i) + "*y";
    for (int i = n - 1; i >= 0; --i) text += "+1/x" + std::to_string(i);
    for (int i = 0; i < n; ++i)
      text += ";x" + std::to_string(i) + "=sin(x+" + std::to_string(i) + ")";
    return text;
  };
  const auto exact = [](int n, double x, double y) {
    double sum = 0;
    for (int i = 0; i < n; ++i) sum += std::sin(x + i) * y + 1 / std::sin(x + i);
    return sum;
  };
  for (const int n : {50, 200}) {
    Formula formula(deep(n));
    INFO(n);
    CHECK(run(formula, {formula.node}, 100)[0][99] ==
          Approx(exact(n, 0.1 + 0.37 * 99, 2.0 - 0.11 * 99)).epsilon(1e-10));
  }
}

TEST_CASE("a program knows which inputs it reads") {
  Formula formula("x^2 + 0*y");
  const sim::Program program(formula.graph, {&formula.node, 1}, 2);
  CHECK(program.reads(0));
  CHECK_FALSE(program.reads(1));
  CHECK(formula.graph.reads(formula.node, 0));
  CHECK_FALSE(formula.graph.reads(formula.node, 1));
}
