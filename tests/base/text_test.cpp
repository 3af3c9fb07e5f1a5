#include "core/base/text.h"

#include <catch2/catch.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

using namespace sim;

TEST_CASE("numbers are written shortest and read back as the same bits", "[base]") {
  CHECK(shortest(0.1) == "0.1");
  CHECK(shortest(-9.81) == "-9.81");
  CHECK(shortest(1e300) == "1e+300");
  for (const double value : {1.0 / 3, 5e-324, 1.7976931348623157e308, -0.0, 123456789.125})
    CHECK(std::bit_cast<std::uint64_t>(*parse_number(shortest(value))) ==
          std::bit_cast<std::uint64_t>(value));
}

TEST_CASE("only whole finite numbers are numbers", "[base]") {
  CHECK(parse_number("0.005") == 0.005);
  CHECK(parse_number("+2e-3") == 0.002);
  for (const char* text :
       {"", "nan", "inf", "-inf", "1e400", "1x", "0x10", " 1", "1 ", "--1", "1,5"})
    CHECK_FALSE(parse_number(text));
}

TEST_CASE("only whole decimal integers are integers", "[base]") {
  CHECK(parse_integer("42") == 42);
  CHECK(parse_integer("-7") == -7);
  for (const char* text : {"", "1.0", "1e3", "9223372036854775808", "0x1", "12a"})
    CHECK_FALSE(parse_integer(text));
}

TEST_CASE("a misspelt name finds the nearest known one", "[base]") {
  const std::vector<std::string> known = {"gravity", "drag", "spring"};
  CHECK(nearest("sprng", known) == "spring");
  CHECK(nearest("garvity", known) == "gravity");
  CHECK(nearest("magnet", known).empty());
  CHECK(suggestion("sprin", known) == "did you mean 'spring'?");
  CHECK(suggestion("x", known) == "known: gravity, drag, spring");
}

TEST_CASE("text becomes a JSON string", "[base]") {
  CHECK(json_string("a\"b\\c\n\x01") == "\"a\\\"b\\\\c\\u000a\\u0001\"");
}
