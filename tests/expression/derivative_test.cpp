// Derivatives of formulas, against those on paper and against differences.
#include <catch2/catch.hpp>
#include <random>

#include "core/base/error.h"
#include "tests/expression/formula.h"

using sim_test::Formula;

TEST_CASE("derivatives are those on paper") {
  const std::pair<const char*, const char*> cases[] = {
      {"3", "0"},
      {"y", "0"},
      {"k*x", "k"},
      {"0.5*k*(x-y)^2", "k*(x-y)"},
      {"x^5", "5*x^4"},
      {"x^-2", "-2/x^3"},
      {"x^2.5", "2.5*x^1.5"},
      {"x^0.3", "0.3*x^-0.7"},
      {"2^x", "2^x*log(2)"},
      {"x^y", "y*x^(y-1)"},
      {"1/x", "-1/x^2"},
      {"sqrt(x)", "0.5/sqrt(x)"},
      {"exp(-x*x)", "-2*x*exp(-x*x)"},
      {"log(3*x)", "1/x"},
      {"sin(2*x)", "2*cos(2*x)"},
      {"cos(x)", "-sin(x)"},
      {"tan(x)", "1/cos(x)^2"},
      {"sinh(x)", "cosh(x)"},
      {"cosh(x)", "sinh(x)"},
      {"tanh(x)", "1/cosh(x)^2"},
      {"abs(x)", "sign(x)"},
      {"step(x)*x", "step(x)"},
      {"floor(3*x)", "0"},
      {"min(x^2, y)", "2*x*step(y-x^2)"},
      {"max(x, 2)", "step(x-2)"},
      {"select(step(x-1), x^2, x)", "select(step(x-1), 2*x, 1)"},
      {"4*k*(s^12-s^6); s = y/x", "-4*k*(12*s^12-6*s^6)/x; s = y/x"},
      {"k*(1-exp(-y*(x-1)))^2", "2*k*y*e*(1-e); e = exp(-y*(x-1))"},
  };
  for (const auto& [text, expected] : cases)
    for (const double x : {0.3, 1.25, 2.0, 3.5})
      for (const double y : {0.7, 2.5}) {
        INFO("d/dx " << text << " at " << x << ", " << y);
        CHECK(Formula(text).slope(0, x, y) ==
              Approx(Formula(expected)(x, y)).epsilon(1e-12).margin(1e-300));
      }
}

TEST_CASE("simplification leaves no arithmetic behind in derivatives") {
  const auto operations = [](const char* text, int input) {
    Formula formula(text);
    const int slope = formula.graph.derivative(formula.node, input);
    int count = 0;
    const std::vector<bool> used = formula.graph.used_by({&slope, 1});
    for (std::size_t id = 0; id < used.size(); ++id)
      if (used[id] && sim::operand_count(formula.graph[static_cast<int>(id)].op) > 0) ++count;
    return count;
  };
  CHECK(operations("0.5*k*(x-1)^2", 0) == 2);  // k (x - 1)
  CHECK(operations("k*(x^2+y^2)/2", 0) == 1);  // k x
  CHECK(operations("3*y + sin(y)", 0) == 0);
  CHECK(operations("x*k - 0*exp(x)", 0) == 0);
}

TEST_CASE("equal parts of a formula are one") {
  Formula formula("(x+y)*(y+x)/((x+y)*(x+y))");
  CHECK(formula.graph[formula.node].op == sim::Op::kDivide);
  CHECK(formula.graph[formula.node].operand[0] == formula.graph[formula.node].operand[1]);
}

TEST_CASE("a product with 0 has no value that is not a number") {
  CHECK(Formula("0*log(x) + 1")(-1) == 1);
  CHECK(Formula("x^2").slope(1, std::nan(""), 0) == 0);
}

TEST_CASE("first and second derivatives of random formulas agree with differences") {
  std::mt19937 random(5);
  const std::function<std::string(int)> make = [&](int depth) -> std::string {
    if (depth == 0) {
      const char* const leaves[] = {"x", "y", "k", "c", "0.7", "2"};
      return leaves[random() % 6];
    }
    const std::string a = make(depth - 1), b = make(depth - 1);
    switch (random() % 12) {
      case 0:
        return "(" + a + "+" + b + ")";
      case 1:
        return "(" + a + "-" + b + ")";
      case 2:
      case 3:
        return a + "*" + b;
      case 4:
        return "(" + a + ")/(3+(" + b + ")^2)";
      case 5:
        return "sin(" + a + ")";
      case 6:
        return "exp(-(" + a + ")^2)";
      case 7:
        return "tanh(" + a + ")";
      case 8:
        return "sqrt(1+(" + a + ")^2)";
      case 9:
        return "log(2+cos(" + a + "))";
      case 10:
        return "(1+(" + a + ")^2)^(0.3+0.1*sin(" + b + "))";
      default:
        return "(" + a + ")^3";
    }
  };
  int compared = 0;
  for (int i = 0; i < 400; ++i) {
    const std::string text = make(1 + i % 4);
    Formula formula(text);
    const int first = formula.graph.derivative(formula.node, 0);
    const int second = formula.graph.derivative(first, 1);
    const double x = 0.37, y = 0.81, h = 1e-3;
    // f' = (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12h + O(h^4)
    const auto difference = [&](int id, double dx, double dy) {
      const auto f = [&](double s) { return formula.at(id, x + s * dx, y + s * dy); };
      return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h);
    };
    const double by_x = formula.at(first, x, y), by_xy = formula.at(second, x, y);
    if (!(std::fabs(by_x) < 1e3 && std::fabs(by_xy) < 1e4)) continue;
    INFO(text);
    CHECK(by_x == Approx(difference(formula.node, 1, 0)).epsilon(1e-5).margin(1e-6));
    CHECK(by_xy == Approx(difference(first, 0, 1)).epsilon(1e-4).margin(1e-5));
    ++compared;
  }
  CHECK(compared > 300);
}

TEST_CASE("derivatives that grow out of hand are an error") {
  std::string text = "1";
  for (int i = 0; i < 400; ++i) text += "*sin(x*" + std::to_string(i) + "+y)";
  Formula formula(text);
  int id = formula.node;
  CHECK_THROWS_WITH(
      [&] {
        for (int i = 0; i < 20; ++i) id = formula.graph.derivative(id, i % 2);
      }(),
      Catch::Contains("more than 20000 operations"));
}
