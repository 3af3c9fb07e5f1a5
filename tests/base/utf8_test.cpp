// Characters of UTF-8, against an encoder and rules that are written down once more.
#include "core/base/utf8.h"

#include <catch2/catch.hpp>
#include <cstdio>
#include <vector>

namespace {

// The form of a code in so many bytes, which need not be the shortest: Unicode Standard, table 3-6.
std::string encoded(char32_t code, int bytes) {
  if (bytes == 1) return {static_cast<char>(code)};
  std::string out(static_cast<std::size_t>(bytes), '\0');
  for (int i = bytes - 1; i > 0; --i, code /= 64)
    out[static_cast<std::size_t>(i)] = static_cast<char>(128 + code % 64);
  out[0] = static_cast<char>(256 - (256 >> bytes) + code);
  return out;
}

int shortest(char32_t code) { return code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4; }

bool is_surrogate(char32_t code) { return code >= 0xd800 && code <= 0xdfff; }

// The codes on both sides of every bound that UTF-8 or the rules of shown text have, and one in 61.
std::vector<char32_t> codes() {
  std::vector<char32_t> found;
  for (char32_t code = 0; code < 0x110000; code += code < 0x900 ? 1 : 61) found.push_back(code);
  for (const char32_t bound :
       {0x1000, 0x2028, 0x202e, 0x200e, 0x2066, 0x2069, 0xd800, 0xe000, 0xfeff, 0x10000, 0x1fffe,
        0x20000, 0x40000, 0x80000, 0xe0000, 0xe007f, 0xffffe, 0x100000, 0x10fffe})
    for (char32_t code = bound - 2; code <= bound + 2 && code < 0x110000; ++code)
      found.push_back(code);
  return found;
}

// "a", two, three, four bytes, twice over.
const std::vector<std::string> kMixed = {"a", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x8c\x8d",
                                         "b", "\xdf\xbf", "\xef\xbf\xbd", "\xf4\x8f\xbf\xbf"};

std::string joined(std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += kMixed[i];
  return text;
}

// The end of the last whole character that ends at or before `at`.
std::size_t boundary(std::size_t at) {
  std::size_t end = 0;
  for (const std::string& each : kMixed)
    if (end + each.size() <= at)
      end += each.size();
    else
      break;
  return end;
}

// How text of a stranger is shown: marks that reorder or break lines, and codes that are none.
bool shown_as_it_is(char32_t c) {
  if (c < 0x20 || (c >= 0x7f && c <= 0x9f)) return false;
  for (const char32_t mark : {0x061c, 0x200e, 0x200f, 0x2028, 0x2029, 0x202a, 0x202b, 0x202c,
                              0x202d, 0x202e, 0x2066, 0x2067, 0x2068, 0x2069, 0xfeff})
    if (c == mark) return false;
  return c % 0x10000 < 0xfffe && (c < 0xe0000 || c > 0xe007f);
}

}  // namespace

TEST_CASE("every character is read, and no other form of it", "[base]") {
  std::size_t wrong = 0;
  char32_t last = 0;
  const auto expect = [&](bool right, char32_t code) {
    if (!right) ++wrong, last = code;
  };
  for (const char32_t code : codes()) {
    const int size = shortest(code);
    const std::string form = encoded(code, size);
    const bool valid = !is_surrogate(code);
    const sim::Character read = sim::first_character(form + "\xbf");
    expect(sim::utf8_length(form) == (valid ? form.size() : 0), code);
    expect(read.code == (valid ? std::optional(code) : std::nullopt), code);
    expect(read.bytes == (valid ? form : form.substr(0, 1)), code);
    for (int bytes = size + 1; bytes <= 4; ++bytes)
      expect(sim::utf8_length(encoded(code, bytes)) == 0, code);
    for (std::size_t cut = 0; cut < form.size(); ++cut)
      expect(sim::utf8_length(std::string_view(form).substr(0, cut)) == 0, code);
    for (std::size_t i = 1; i < form.size(); ++i)
      for (const char other : {'\x7f', '\xc0', '\x3f', '\xff'}) {
        std::string broken = form;
        broken[i] = other;
        expect(sim::utf8_length(broken) == 0, code);
      }
  }
  for (const char32_t code : {0x110000, 0x13ffff, 0x140000, 0x1fffff})
    expect(sim::utf8_length(encoded(code, 4)) == 0, code);
  for (int byte = 0x80; byte < 0x100; ++byte)
    if (byte < 0xc2 || byte > 0xf4) {
      const std::string text = static_cast<char>(byte) + std::string("\x80\x80\x80");
      expect(sim::utf8_length(text) == 0, static_cast<char32_t>(byte));
    }
  INFO("last wrong: " << std::hex << static_cast<unsigned>(last));
  CHECK(wrong == 0);
}

TEST_CASE("text is cut between characters, at every length", "[base]") {
  const std::string text = joined(kMixed.size());
  for (std::size_t at = 0; at <= text.size() + 2; ++at) {
    INFO(at);
    CHECK(sim::utf8_head(text, at) == text.substr(0, boundary(at)));
    if (at > text.size()) continue;
    CHECK(sim::unfinished_utf8(text.substr(0, at)) == at - boundary(at));
    // Bytes that are no UTF-8 are cut exactly at the limit.
    CHECK(sim::utf8_head(std::string(text.size() + 1, '\x80'), at) == std::string(at, '\x80'));
  }
  for (std::size_t count = 0; count <= kMixed.size(); ++count) {
    INFO(count);
    CHECK(sim::columns_of(joined(count)) == count);
    CHECK(sim::columns_of(joined(count) + "\xff\x80") == count + 2);
    CHECK(sim::cut_columns(text, count) == joined(count));
    CHECK(sim::cut_columns(text, kMixed.size() + count) == text);
    CHECK(sim::cut_columns("", count).empty());
  }
  CHECK(sim::utf8_length("") == 0);
  CHECK(sim::unfinished_utf8("") == 0);
  // Bytes that continue nothing, or begin nothing, are not waited for.
  for (const char* const ended : {"\x80", "\x80\x80\x80\x80", "\xc1", "a\xc0", "\xe2\x82\xac\x80"})
    CHECK(sim::unfinished_utf8(ended) == 0);
}

TEST_CASE("text of a stranger is shown by one rule for every code", "[base]") {
  std::size_t wrong = 0;
  char32_t last = 0;
  for (const char32_t code : codes()) {
    if (is_surrogate(code)) continue;
    const std::string form = encoded(code, shortest(code));
    char escape[16];
    std::snprintf(escape, sizeof escape,
                  code < 0x80      ? "\\x%02x"
                  : code < 0x10000 ? "\\u%04x"
                                   : "\\U%08x",
                  static_cast<unsigned>(code));
    const std::string line = shown_as_it_is(code) ? form : escape;
    const std::string text = code == '\n' || code == '\t' ? form : line;
    // Behind a letter, and before a byte that is none, which has to be escaped whatever stands
    // here.
    const bool right = sim::visible_line(form) == line && sim::visible_text(form) == text &&
                       sim::visible_text("z" + form + "\xfe") == "z" + text + "\\xfe" &&
                       sim::is_visible("z" + form) == (text == form);
    if (!right) ++wrong, last = code;
  }
  INFO("last wrong: " << std::hex << static_cast<unsigned>(last));
  CHECK(wrong == 0);
  CHECK(sim::visible_text("").empty());
  CHECK(sim::visible_line("").empty());
  CHECK(sim::is_visible(""));
}
