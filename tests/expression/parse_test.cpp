// Reading formulas: what they mean, and what is wrong with those that mean nothing.
#include <catch2/catch.hpp>
#include <random>

#include "core/base/error.h"
#include "tests/expression/formula.h"

using sim_test::Formula;

namespace {

std::string error_of(const std::string& text) {
  try {
    Formula formula(text);
  } catch (const sim::Error& error) {
    CHECK(error.kind() == sim::ErrorKind::kScene);
    return error.what();
  }
  return "no error";
}

std::string repeated(const std::string& part, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += part;
  return text;
}

}  // namespace

TEST_CASE("formulas bind as in mathematics") {
  const std::pair<const char*, double> cases[] = {
      {"1 + 2 * 3", 7},
      {"(1 + 2) * 3", 9},
      {"10 - 4 - 3", 3},
      {"16 / 4 / 2", 2},
      {"2 * 3 ^ 2", 18},
      {"-2 ^ 2", -4},
      {"(-2) ^ 2", 4},
      {"2 ^ 3 ^ 2", 512},
      {"2 ^ -1", 0.5},
      {"2 ^ -1 ^ 2", 0.5},
      {"--3", 3},
      {"- -3 - +2", 1},
      {"2 * -3", -6},
      {"1e3 + .5 + 2.", 1002.5},
      {"4 ^ 0.5 + 4 ^ -1.5", 2.125},
      {"\t1 +\n 2 ", 3},
      {"max(2, min(5, 3)) + abs(-4)", 7},
      {"select(step(-1), 10, 20)", 20},
      {"pow(2, 10) + sign(-9) + floor(2.7)", 1025},
      {"sqrt(16) * exp(log(3))", 12},
      {"k * k + c", 8.5},
      {"2 * a + b; a = b + 1; b = 5", 17},
      {"a * a; a = 2;", 4},
  };
  for (const auto& [text, value] : cases) {
    INFO(text);
    CHECK(Formula(text)() == Approx(value).epsilon(1e-15));
  }
  CHECK(Formula("cos(pi)")() == -1);
  CHECK(Formula("x - 2*y")(7, 2) == 3);
}

TEST_CASE("comparisons are 1 where they are true and 0 where not, and if() chooses by them") {
  for (const double x : {-1.5, -0.0, 0.0, 2.0, 1e-320, 1e300})
    for (const double y : {-1.5, 0.0, 2.0, 2.5, -1e300}) {
      CAPTURE(x, y);
      CHECK(Formula("x < y")(x, y) == (x < y));
      CHECK(Formula("x <= y")(x, y) == (x <= y));
      CHECK(Formula("x > y")(x, y) == (x > y));
      CHECK(Formula("x >= y")(x, y) == (x >= y));
      CHECK(Formula("if(x + 1 < y, 10*x, y - 1)")(x, y) == (x + 1 < y ? 10 * x : y - 1));
      CHECK(Formula("2*(x <= y) + if(x - y, 4, 8)")(x, y) == 2 * (x <= y) + (x - y != 0 ? 4 : 8));
    }
  CHECK(Formula("if(2, 3, 4)")() == 3);
  CHECK(Formula("if(-0.5, 3, 4)")() == 3);
  CHECK(std::isnan(Formula("x < y")(std::nan(""), 1)));
  // The slope is that of the branch.
  Formula branches("if(x < y, x^3, 5*x)");
  CHECK(branches.slope(0, 1, 2) == 3);
  CHECK(branches.slope(0, 3, 2) == 5);
}

TEST_CASE("errors of formulas name the column and the nearest name") {
  const std::pair<std::string, std::vector<const char*>> cases[] = {
      {"", {"column 1", "it ends"}},
      {"1 +", {"column 4", "it ends"}},
      {"1 + * 2", {"column 5", "unexpected '*'"}},
      {"(1 + 2", {"column 7", "')' is missing"}},
      {"1 + 2)", {"column 6", "unexpected ')'"}},
      {"2 x", {"column 3", "unexpected 'x'", "write * between"}},
      {"k*zz", {"column 3", "'zz' is not known", "give zz = NUMBER"}},
      {"sinn(1)", {"column 1", "no function 'sinn'", "did you mean 'sin'"}},
      {"x(1)", {"column 1", "no function 'x'"}},
      {"sin + 1", {"column 1", "needs its arguments"}},
      {"sin(1, 2)", {"column 1", "'sin' takes 1 argument"}},
      {"min(1)", {"'min' takes 2 arguments"}},
      {"min(1, 2, 3)", {"'min' takes 2 arguments"}},
      {"min(1, 2", {"column 9", "')' is missing"}},
      {"select(1, 2)", {"'select' takes 3 arguments"}},
      {"x ** 2", {"column 4", "unexpected '*'"}},
      {"1 < x < 2", {"column 7", "unexpected '<'", "a < b, a <= b"}},
      {"x == 2", {"column 3", "unexpected '='", "a < b, a <= b"}},
      {"x <", {"column 4", "it ends"}},
      {"if(x < 2, 1)", {"'if' takes 3 arguments"}},
      {"1.2.3", {"column 4"}},
      {"1e", {"column 2"}},
      {"1e999", {"column 1", "too large"}},
      {"x = 3", {"column 3", "unexpected '='"}},
      {"$", {"column 1", "unexpected '$'"}},
      {"\x01\xff", {"column 1", "unexpected character"}},
      {"a; a = b; b = a", {"column 15", "leads back to itself"}},
      {"a; a = 1; a = 2", {"column 11", "has a meaning already"}},
      {"1; x = 2", {"column 4", "'x' has a meaning already"}},
      {"1; k = 2", {"column 4", "'k' has a meaning already"}},
      {"1; d = 2", {"column 4", "'d' is defined but not used"}},
      {"a; a = 1; d = 2", {"column 11", "'d' is defined but not used"}},
      {"a; a = ", {"column 8", "it ends"}},
      {"a; = 2", {"column 4", "expected NAME = FORMULA"}},
      {"1/0", {"not finite", "division by 0"}},
      {"x + sqrt(c)", {"not finite"}},
  };
  for (const auto& [text, parts] : cases) {
    const std::string message = error_of(text);
    INFO(text << " -> " << message);
    CHECK(message.find("bad formula") == 0);
    for (const char* part : parts) CHECK(message.find(part) != std::string::npos);
    CHECK(message.find('\n') == std::string::npos);
  }
}

TEST_CASE("formulas remember which names they use") {
  CHECK(Formula("k*x").names.used == std::set<std::string>{"k", "x"});
  CHECK(Formula("a; a = c").names.used == std::set<std::string>{"c"});
  CHECK(Formula("pi").names.used.empty());
}

TEST_CASE("formulas from strangers are refused, not fallen over") {
  for (const char* part : {"(", "-", "x^", "sin(", "2^-", "x*(", "((x)+", "a;a=", "min(x,"}) {
    INFO(part);
    CHECK(error_of(repeated(part, 5000)).find("bad formula") == 0);
    CHECK(error_of(repeated(part, 400000)).find("more than 10000 characters") != std::string::npos);
  }
  // The longest that is read, and one character more.
  CHECK(Formula(std::string(9999, ' ') + "x")(4) == 4);
  CHECK(error_of(std::string(10000, ' ') + "x").find("column 10001") != std::string::npos);
  CHECK(error_of(repeated("(", 150) + "x" + repeated(")", 150)).find("nested deeper") !=
        std::string::npos);
  CHECK(Formula(repeated("(", 80) + "x" + repeated(")", 80))(4) == 4);
  CHECK(Formula(repeated("x+", 4000) + "x")(1) == 4001);
  CHECK(Formula(repeated("x*", 4000) + "x")(1) == 1);

  // A doubling at each level would take 2^60 operations; equal parts are one.
  std::string text = "a0";
  for (int i = 0; i < 60; ++i)
    text +=
        "; a" + std::to_string(i) + " = a" + std::to_string(i + 1) + "+a" + std::to_string(i + 1);
  CHECK(Formula(text + "; a60 = x")(1) == std::ldexp(1.0, 60));
}

TEST_CASE("random texts are formulas or errors") {
  std::mt19937 random(11);
  const char* const parts[] = {"x",     "y",   "k",    "1",    "0",       "2.5", "+",    "-",
                               "*",     "/",   "^",    "(",    ")",       ",",   ";",    "=",
                               "a",     " ",   "sin(", "min(", "pi",      "e",   "log(", "exp(",
                               "sqrt(", "1e9", "%",    "\0",   "select(", "c"};
  int formulas = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text;
    for (int length = static_cast<int>(random() % 12); length >= 0; --length)
      text += parts[random() % std::size(parts)];
    try {
      Formula formula(text);
      formula(0.5, -2);
      formula.slope(0, 0.5, -2);
      ++formulas;
    } catch (const sim::Error& error) {
      INFO(text);
      REQUIRE(error.kind() == sim::ErrorKind::kScene);
    }
  }
  CHECK(formulas > 100);
}
