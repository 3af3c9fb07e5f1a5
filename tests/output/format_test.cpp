// Text in columns and lines, and fields of tables, against plain loops.
#include "core/output/format.h"

#include <catch2/catch.hpp>

namespace {

using Words = std::vector<std::string>;

// Each line takes words while it has room, whatever stands in it already.
std::string wrapped_plainly(const Words& words, std::size_t indent, std::size_t used,
                            std::size_t width) {
  std::string line(used, '#'), text;
  bool empty = true;  // but for the indent, or what stands before
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string next = (i > 0 && !empty ? " " : "") + words[i];
    if (line.size() > indent && line.size() + 1 + words[i].size() > width) {
      text += line + '\n';
      line = std::string(indent, ' ') + words[i];
    } else {
      line += next;
    }
    empty = false;
  }
  return (text + line).substr(used);
}

std::string joined(const Words& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

}  // namespace

TEST_CASE("text is broken between words where a line is full, and nowhere else") {
  std::mt19937 dice(1);
  for (int k = 0; k < 2000; ++k) {
    Words words(1 + dice() % 30);
    for (std::string& word : words) word.assign(1 + dice() % 12, static_cast<char>('a' + k % 26));
    const std::size_t indent = dice() % 8, used = dice() % 12, width = 20 + dice() % 60;
    CAPTURE(joined(words), indent, used, width);
    REQUIRE(sim::wrapped(joined(words), indent, used, width) ==
            wrapped_plainly(words, indent, used, width));
  }
  // Lines of 80 columns unless another width is said, behind nothing.
  const std::string word(39, 'x');
  CHECK(sim::wrapped(word + " " + word + "y", 2) == word + " " + word + "y");
  CHECK(sim::wrapped(word + " " + word + "yz", 2) == word + "\n  " + word + "yz");
  // Characters count, not bytes; a word that is too long stays whole.
  const std::string umlauts = "\xC3\xA4\xC3\xB6\xC3\xBC";
  CHECK(sim::wrapped(umlauts + " " + umlauts, 0, 0, 7) == umlauts + " " + umlauts);
  CHECK(sim::wrapped(umlauts + " " + umlauts, 0, 0, 6) == umlauts + "\n" + umlauts);
  CHECK(sim::wrapped("ab " + word + " c", 1, 0, 10) == "ab\n " + word + "\n c");
  CHECK(sim::wrapped("", 3).empty());
}

TEST_CASE("columns are as wide as they need to be, in characters") {
  const std::string umlaut = "\xC3\xA4";
  CHECK(sim::left("ab", 4) == "ab  ");
  CHECK(sim::right("ab", 4) == "  ab");
  CHECK(sim::left(umlaut, 3) == umlaut + "  ");
  CHECK(sim::right(umlaut, 3) == "  " + umlaut);
  CHECK(sim::left("abc", 2) == "abc");
  CHECK(sim::right("abc", 2) == "abc");
  CHECK(sim::label("name", "text") == "name        text\n");
  CHECK(sim::label("name", "text", 5) == "name text\n");
  CHECK(sim::indented("a\nb\n\nc") == "  a\n  b\n  \n  c\n");
  CHECK(sim::indented("a\n", ">") == ">a\n");
  CHECK(sim::aligned({{"a", "bb", "c"}, {umlaut + "xx", "", "d"}, {"", "b"}, {}}) ==
        "  a    bb  c\n  " + umlaut + "xx      d\n       b\n\n");
}

TEST_CASE("fields of a row come back as they were") {
  for (const Words& fields :
       {Words{"a", "b"}, Words{"", ""}, Words{"a,b", "say \"x\"", "\"", ",", "\"\"", "c"},
        Words{"=1+1", " x ", "'"}}) {
    std::string row;
    for (std::size_t i = 0; i < fields.size(); ++i)
      row += (i > 0 ? "," : "") + sim::csv_field(fields[i]);
    INFO(row);
    CHECK(sim::csv_fields(row) == fields);
  }
  CHECK(sim::csv_field("plain text") == "plain text");
  CHECK(sim::csv_field("a,b") == "\"a,b\"");
  CHECK(sim::csv_field("a\"b") == "\"a\"\"b\"");
  CHECK(sim::csv_field("a\nb") == "\"a\nb\"");
  CHECK(sim::csv_field("a\rb") == "\"a\rb\"");
}

TEST_CASE("objects of JSON have their keys in the order of the calls") {
  CHECK(sim::JsonObject().str() == "{}");
  CHECK(sim::JsonObject()
            .text("a", "x\"y\\\n\x01")
            .number("b", 0.1)
            .number("c", std::nan(""))
            .number("d", -HUGE_VAL)
            .integer("e", std::int64_t{-9007199254740993})
            .flag("f", true)
            .flag("g", false)
            .json("h", sim::json_array(Words{"1", "{}", "\"x\""}))
            .json("i", sim::json_array(Words{}))
            .str() ==
        "{\"a\":\"x\\\"y\\\\\\u000a\\u0001\",\"b\":0.1,\"c\":null,\"d\":null,"
        "\"e\":-9007199254740993,\"f\":true,\"g\":false,"
        "\"h\":[1,{},\"x\"],\"i\":[]}");
}
