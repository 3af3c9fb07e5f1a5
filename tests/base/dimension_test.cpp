// Units as documents write them.
#include "core/base/dimension.h"

#include <catch2/catch.hpp>

using sim::Dimension;
using sim::dimension_of;

TEST_CASE("units are products of powers of m, s and kg") {
  const struct {
    const char* text;
    Dimension dimension;
  } cases[] = {
      {"m", {{1, 0, 0}, 1}},         {"N/m", {{0, -2, 1}, 1}},     {"N s/m", {{0, -1, 1}, 1}},
      {"kg/m^3", {{-3, 0, 1}, 1}},   {"kg/m3", {{-3, 0, 1}, 1}},   {"m/s2", {{1, -2, 0}, 1}},
      {"kg*m/s^2", {{1, -2, 1}, 1}}, {"1/s", {{0, -1, 0}, 1}},     {"rad/s", {{0, -1, 0}, 1}},
      {"Hz", {{0, -1, 0}, 1}},       {"Pa s", {{-1, -1, 1}, 1}},   {"N m", {{2, -2, 1}, 1}},
      {"m/m", {{0, 0, 0}, 1}},       {"mm", {{1, 0, 0}, 1e-3}},    {"GPa", {{-1, -2, 1}, 1e9}},
      {"g/cm^3", {{-3, 0, 1}, 1e3}}, {"kN/mm", {{0, -2, 1}, 1e6}}, {"J/s/W", {{0, 0, 0}, 1}},
  };
  for (const auto& each : cases) {
    INFO(each.text);
    const auto found = dimension_of(each.text);
    REQUIRE(found);
    CHECK(*found == each.dimension);
  }
  CHECK_FALSE(*dimension_of("m") == *dimension_of("mm"));
  CHECK_FALSE(*dimension_of("m") == *dimension_of("s"));
  CHECK_FALSE(*dimension_of("N") == *dimension_of("J"));
}

TEST_CASE("other words are no units") {
  for (const char* text :
       {"", " ", "/", "m/", "/m", "m//s", "m**s", "particles a side", "N/m^power", "m^", "m^12",
        "m^-1", "^2", "2", "mean", "of the sphere", "kg /"})
    CHECK_FALSE(dimension_of(text));
}
