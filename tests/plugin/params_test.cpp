// Errors of values that do not fit a parameter.
#include "core/plugin/params.h"

#include <catch2/catch.hpp>

using namespace sim;

namespace {

std::string error_of(const Param& param, const Value& value) {
  try {
    const Params params("force 'push'", {&param, 1}, {{param.name, value}}, "a.lua:3");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a value of another type is shown, and what is wanted in its unit") {
  const Param number{.name = "k", .unit = "N/m", .doc = "stiffness"};
  const std::string before = "force 'push': a.lua:3: k is ", after = "; give a number in N/m";
  CHECK(error_of(number, Value(std::string("soft"))) == before + "'soft'" + after);
  CHECK(error_of(number, Value(std::string())) == before + "''" + after);
  CHECK(error_of(number, Value(true)) == before + "true" + after);
  CHECK(error_of(number, Value(Vec3(1, 2, 3))) == before + "{1, 2, 3}" + after);
  CHECK(error_of(number, Value(OdeFunction())) == before + "a function" + after);
  CHECK(error_of(number, Value(std::int64_t{3})) == "");
  CHECK(error_of(number, Value(3.5)) == "");
  const Param text{.name = "law", .type = ParamType::kText};
  CHECK(error_of(text, Value(2.5)) == "force 'push': a.lua:3: law is 2.5; give a text");
}

TEST_CASE("numbers are taken up to their bounds, and not beyond") {
  const Param share{.name = "share", .min = 0, .max = 1};
  for (const double right : {0.0, 0.5, 1.0}) CHECK(error_of(share, right) == "");
  for (const double wrong : {-1e-9, 1 + 1e-9, std::nan(""), HUGE_VAL})
    CHECK(error_of(share, wrong).starts_with("force 'push': a.lua:3: share is "));
  const Param choice{.name = "law", .type = ParamType::kText, .choices = {"a", "b"}};
  CHECK(error_of(choice, std::string("b")) == "");
  CHECK(error_of(choice, std::string("c")).starts_with("force 'push': a.lua:3: law is 'c'; "));
  // A missing one, an unknown one.
  const Param needed{.name = "k", .unit = "N/m", .doc = "stiffness", .required = true};
  CHECK_THROWS_WITH(
      Params("force 'push'", {&needed, 1}, {}, "a.lua:3"),
      "force 'push': a.lua:3: its parameter 'k' is missing; give k, stiffness in N/m");
  CHECK_THROWS_WITH(Params("force 'push'", {&share, 1}, {{"shar", 1.0}}, ""),
                    "force 'push': it has no parameter 'shar'; did you mean 'share'?");
}
