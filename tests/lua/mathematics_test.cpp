// The results of scenes have the same bits on every machine, whatever the C library and its locale.
#include <bit>
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <random>

#include "core/base/text.h"
#include "core/math/elementary.h"
#include "tests/lua/scene_text.h"
#include "tests/support/skip.h"

using namespace sim;
using namespace sim::test;

namespace {

// Runs the lines in a scene; an error in them fails the test.
void run(const std::string& lines) {
  load_text(lines +
            "\nreturn sim.scene { state = {1}, field = sim.field.lua { function(t, x) return "
            "{-x[1]} end }, "
            "integrator = \"rk4\", dt = 0.1, duration = 1 }\n");
}

// A line that holds if Lua and we have the same bits.
std::string equal(const std::string& expression, double value) {
  return "assert(" + expression + " == " + shortest(value) + ", \"" + expression + "\")\n";
}

}  // namespace

TEST_CASE("functions of math are our own") {
  using Function = double (*)(double);
  const std::pair<const char*, Function> functions[] = {
      {"sin", elementary::sin},   {"cos", elementary::cos},   {"tan", elementary::tan},
      {"asin", elementary::asin}, {"acos", elementary::acos}, {"atan", nullptr},
      {"exp", elementary::exp},   {"log", elementary::log},   {"log10", elementary::log10},
      {"sinh", elementary::sinh}, {"cosh", elementary::cosh}, {"tanh", elementary::tanh}};
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> fraction(0, 1);
  std::string lines;
  for (const auto& [name, function] : functions)
    for (int i = 0; i < 100; ++i) {
      const double x = fraction(generator);
      lines += equal("math." + std::string(name) + "(" + shortest(x) + ")",
                     function ? function(x) : elementary::atan2(x, 1));
    }
  for (int i = 0; i < 100; ++i) {
    const double x = fraction(generator), y = fraction(generator);
    const std::string both = "(" + shortest(x) + ", " + shortest(y) + ")";
    lines += equal("math.atan" + both, elementary::atan2(x, y));
    lines += equal("math.pow" + both, elementary::pow(x, y));
    lines += equal("math.log" + both, elementary::log(x) / elementary::log(y));
    lines += equal("math.log(" + shortest(x) + ", 2)", elementary::log2(x));
    lines += equal("math.log(" + shortest(x) + ", 10)", elementary::log10(x));
  }
  run(lines);
}

// Lua must not use the power of the C library, whose last bit may differ.
TEST_CASE("the operator ^ is our own: of constants, of variables and of texts") {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> base(0.1, 10), exponent(-5, 5);
  std::string lines = "local function power(x, y) return x ^ y end\n";
  int found = 0;
  for (int i = 0; i < 1'000'000 && found < 20; ++i) {
    const double x = base(generator), y = exponent(generator), value = elementary::pow(x, y);
    if (std::pow(x, y) == value) continue;
    ++found;
    const std::string a = shortest(x), b = shortest(y);
    lines += equal(a + " ^ " + b, value) + equal("power(" + a + ", " + b + ")", value) +
             equal("power('" + a + "', " + b + ")", value);
  }
  CAPTURE(found);
  run(lines);
}

TEST_CASE("random numbers of a seed are the same everywhere") {
  run("math.randomseed(42)\n"
      "assert(math.random() == 0.93081217803956817 and math.random(1, 1000000) == 545842)\n");
}

TEST_CASE("numbers are read and written with a point in every locale") {
  sim_test::need_program("localedef", "locales");
  const SceneFolder folder;
  const std::string made = (folder.path() / "de_DE.UTF-8").string();
  REQUIRE(std::system(("localedef -i de_DE -f UTF-8 " + made + " 2>/dev/null").c_str()) == 0);
  setenv("LOCPATH", folder.path().c_str(), 1);
  const bool changed = std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
  const std::string point = std::localeconv()->decimal_point;
  std::string problem;
  try {
    run("assert(tostring(1.5) == '1.5' and tonumber('2.5') == 2.5 and not tonumber('2,5'))\n"
        "assert(string.format('%.2f', 0.25) == '0.25' and 0.5 .. '' == '0.5')\n"
        "assert('a' > 'B')\n");
  } catch (const Error& error) {
    problem = error.what();
  }
  std::setlocale(LC_ALL, "C");
  unsetenv("LOCPATH");
  CHECK(changed);
  CHECK(point == ",");
  CHECK(problem == "");
}
