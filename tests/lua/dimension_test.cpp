// Units as documents write them.
#include "core/lua/dimension.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

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
      {"N  m", {{2, -2, 1}, 1}},     {"kg * m", {{1, 0, 1}, 1}},   {"m / s", {{1, -1, 0}, 1}},
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

// The brochure of the SI, 9th edition (2019): tables 2, 4, 7 and 8; a minute of arc has no name
// here.
TEST_CASE("every unit has its size and its powers") {
  const struct {
    const char* text;
    int m, s, kg;
    double size;
  } units[] = {
      {"1", 0, 0, 0, 1},
      {"rad", 0, 0, 0, 1},
      {"deg", 0, 0, 0, M_PI / 180},
      {"degrees", 0, 0, 0, M_PI / 180},
      {"m", 1, 0, 0, 1},
      {"km", 1, 0, 0, 1000},
      {"cm", 1, 0, 0, 0.01},
      {"mm", 1, 0, 0, 0.001},
      {"um", 1, 0, 0, 0.000001},
      {"s", 0, 1, 0, 1},
      {"ms", 0, 1, 0, 0.001},
      {"us", 0, 1, 0, 0.000001},
      {"Hz", 0, -1, 0, 1},
      {"kg", 0, 0, 1, 1},
      {"g", 0, 0, 1, 0.001},
      {"N", 1, -2, 1, 1},
      {"kN", 1, -2, 1, 1000},
      {"mN", 1, -2, 1, 0.001},
      {"J", 2, -2, 1, 1},
      {"kJ", 2, -2, 1, 1000},
      {"mJ", 2, -2, 1, 0.001},
      {"W", 2, -3, 1, 1},
      {"Pa", -1, -2, 1, 1},
      {"kPa", -1, -2, 1, 1000},
      {"MPa", -1, -2, 1, 1e6},
      {"GPa", -1, -2, 1, 1e9},
  };
  for (const auto& unit : units) {
    const std::string name = unit.text;
    INFO(name);
    const auto plain = dimension_of(name), below = dimension_of("1/" + name),
               square = dimension_of(name + "2"), both = dimension_of("kg/" + name + " s");
    REQUIRE((plain && below && square && both));
    CHECK(plain->power == std::array<int, 3>{unit.m, unit.s, unit.kg});
    CHECK(plain->size == Approx(unit.size).epsilon(1e-14));
    CHECK(below->power == std::array<int, 3>{-unit.m, -unit.s, -unit.kg});
    CHECK(below->size == Approx(1 / unit.size).epsilon(1e-14));
    CHECK(square->power == std::array<int, 3>{2 * unit.m, 2 * unit.s, 2 * unit.kg});
    CHECK(square->size == Approx(unit.size * unit.size).epsilon(1e-14));
    // A space ends what a line divides by.
    CHECK(both->power == std::array<int, 3>{-unit.m, 1 - unit.s, 1 - unit.kg});
    CHECK(both->size == Approx(1 / unit.size).epsilon(1e-14));
  }
}

TEST_CASE("sizes of units are equal but for rounding") {
  const Dimension metre{{1, 0, 0}, 1};
  CHECK(metre == Dimension{{1, 0, 0}, 1 + 1e-13});
  CHECK(metre == Dimension{{1, 0, 0}, 1 - 1e-13});
  CHECK_FALSE(metre == Dimension{{1, 0, 0}, 1 + 1e-11});
  CHECK_FALSE(metre == Dimension{{1, 0, 0}, 1 - 1e-11});
  CHECK_FALSE(metre == Dimension{{1, 0, 1}, 1});
  // Large and small ones by the same share.
  CHECK(Dimension{{0, 0, 0}, 1e9} == Dimension{{0, 0, 0}, 1e9 * (1 + 1e-13)});
  CHECK_FALSE(Dimension{{0, 0, 0}, 1e-9} == Dimension{{0, 0, 0}, 1e-9 * (1 + 1e-11)});
}

TEST_CASE("other words are no units") {
  for (const char* text :
       {"", " ", "/", "m/", "/m", "m//s", "m**s", "particles a side", "N/m^power", "m^", "m^12",
        "m^-1", "^2", "2", "mean", "of the sphere", "kg /"})
    CHECK_FALSE(dimension_of(text));
}
