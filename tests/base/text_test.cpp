#include "core/base/text.h"

#include <catch2/catch.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "core/base/utf8.h"

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
  // A letter too many, too few or another, and two that are turned, at either end: one each. Of
  // four letters one may be wrong, of six two.
  for (const char* text :
       {"rdag", "drga", "rag", "dra", "xdrag", "dragx", "xrag", "drax", "darg"}) {
    INFO(text);
    CHECK(nearest(text, known) == "drag");
  }
  for (const char* text : {"rdga", "ragx", "dg", "xdragx"}) {
    INFO(text);
    CHECK(nearest(text, known).empty() == (std::string(text) != "xdragx"));
  }
  CHECK(nearest("psirng", known) == "spring");
  CHECK(nearest("psrixx", known).empty());
  CHECK(suggestion("sprin", known) == "did you mean 'spring'?");
  CHECK(suggestion("x", known) == "known: gravity, drag, spring");
}

TEST_CASE("text becomes a JSON string", "[base]") {
  CHECK(json_string("a\"b\\c\n\x01") == "\"a\\\"b\\\\c\\u000a\\u0001\"");
}

TEST_CASE("text is cut and measured by characters", "[base]") {
  const std::string euro = "\xe2\x82\xac";
  CHECK(sim::utf8_head("a" + euro + "b", 1) == "a");
  CHECK(sim::utf8_head("a" + euro + "b", 3) == "a");
  CHECK(sim::utf8_head("a" + euro + "b", 4) == "a" + euro);
  CHECK(sim::utf8_head("\x80\x80\x80\x80", 2) == "\x80\x80");
  CHECK(sim::columns_of(euro + "\xff") == 2);
  CHECK(sim::cut_columns(euro + euro + "x", 2) == euro + euro);
  CHECK(sim::unfinished_utf8("a\xe2\x82") == 2);
  CHECK(sim::unfinished_utf8("a" + euro) == 0);
  CHECK(sim::unfinished_utf8("a\x82") == 0);
}

TEST_CASE("text of a stranger is shown, whatever its bytes", "[base]") {
  CHECK(sim::visible_text("a\x1b\n\t\r\x7f") == "a\\x1b\n\t\\x0d\\x7f");
  CHECK(sim::visible_line("a\n") == "a\\x0a");
  CHECK(sim::visible_text("\xc2\x9b\xe2\x80\xae\xf3\xa0\x81\x81") == "\\u009b\\u202e\\U000e0041");
  // A surrogate, a longer form of a short code, a code beyond the last, a piece of a character.
  for (const char* wrong : {"\xed\xa0\x80", "\xc0\x80", "\xf4\x90\x80\x80", "\xe2\x82"}) {
    const std::string shown = sim::visible_text(wrong);
    CHECK(shown.size() == 4 * std::string(wrong).size());
    CHECK(sim::is_visible(shown));
  }
  CHECK(sim::is_visible("\xc3\xa4 \xe2\x82\xac \xf0\x9f\x98\x80"));
  CHECK(json_string("\xff\xc2\x85\x7f") == "\"\\ufffd\\u0085\\u007f\"");
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes(random() % 12, '\0');
    for (char& c : bytes) c = static_cast<char>(random() % 2 ? random() : 0x80 + random() % 0x80);
    CHECK(sim::is_visible(sim::visible_text(bytes)));
    CHECK(sim::is_visible(json_string(bytes)));
  }
}
