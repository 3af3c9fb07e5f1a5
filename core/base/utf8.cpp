#include "core/base/utf8.h"

#include <algorithm>

namespace sim {
namespace {

constexpr std::string_view kHex = "0123456789abcdef";

char32_t code_point(std::string_view character) {
  constexpr unsigned char kMask[] = {0, 0x7f, 0x1f, 0x0f, 0x07};
  auto code =
      static_cast<char32_t>(static_cast<unsigned char>(character[0]) & kMask[character.size()]);
  for (const char c : character.substr(1))
    code = code << 6 | (static_cast<unsigned char>(c) & 0x3f);
  return code;
}

bool is_control(char32_t code) { return code < 0x20 || (code >= 0x7f && code < 0xa0); }

// Marks that reorder or break the line that they stand in, and codes that are no characters.
bool is_disguise(char32_t code) {
  return code == 0x061c || code == 0x200e || code == 0x200f || (code >= 0x2028 && code <= 0x202e) ||
         (code >= 0x2066 && code <= 0x2069) || code == 0xfeff || (code & 0xfffe) == 0xfffe ||
         (code >= 0xe0000 && code <= 0xe007f);
}

// "1b" in as many digits as asked for.
void append_hex(std::string& out, char32_t code, int digits) {
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) out += kHex[code >> shift & 15];
}

// The quick way out.
bool is_ascii(std::string_view text, bool lines) {
  return std::ranges::all_of(text, [lines](char c) {
    return (c >= 0x20 && c < 0x7f) || (lines && (c == '\n' || c == '\t'));
  });
}

std::string escaped(std::string_view text, bool lines) {
  if (is_ascii(text, lines)) return std::string(text);
  std::string out;
  while (!text.empty()) {
    const Character next = first_character(text);
    text.remove_prefix(next.bytes.size());
    if (next.visible() || (lines && (next.code == U'\n' || next.code == U'\t'))) {
      out += next.bytes;
    } else if (!next.code || *next.code < 0x80) {
      out += "\\x";
      append_hex(out, static_cast<unsigned char>(next.bytes[0]), 2);
    } else {
      const bool wide = *next.code > 0xffff;
      out += wide ? "\\U" : "\\u";
      append_hex(out, *next.code, wide ? 8 : 4);
    }
  }
  return out;
}

}  // namespace

bool Character::visible() const { return code && !is_control(*code) && !is_disguise(*code); }

Character first_character(std::string_view text) {
  const std::size_t length = utf8_length(text);
  const std::string_view bytes = text.substr(0, std::max<std::size_t>(1, length));
  return {bytes, length > 0 ? std::optional(code_point(bytes)) : std::nullopt};
}

std::size_t utf8_length(std::string_view text) {
  if (text.empty()) return 0;
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = at(0);
  if (first < 0x80) return 1;
  const std::size_t length = first < 0xc2   ? 0
                             : first < 0xe0 ? 2
                             : first < 0xf0 ? 3
                             : first < 0xf5 ? 4
                                            : 0;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((at(i) & 0xc0) != 0x80) return 0;
  // No longer form of a short code, no surrogate, nothing above U+10FFFF.
  const bool wrong = (first == 0xe0 && at(1) < 0xa0) || (first == 0xed && at(1) >= 0xa0) ||
                     (first == 0xf0 && at(1) < 0x90) || (first == 0xf4 && at(1) >= 0x90);
  return wrong ? 0 : length;
}

std::string_view utf8_head(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t end = most;
  while (end > 0 && most - end < 3 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  return text.substr(0, utf8_length(text.substr(end)) > 0 ? end : most);
}

std::size_t unfinished_utf8(std::string_view text) {
  for (std::size_t count = 1; count <= std::min<std::size_t>(3, text.size()); ++count) {
    const auto byte = static_cast<unsigned char>(text[text.size() - count]);
    if ((byte & 0xc0) == 0x80) continue;
    const std::size_t length = byte >= 0xf0 ? 4 : byte >= 0xe0 ? 3 : byte >= 0xc2 ? 2 : 1;
    return length > count ? count : 0;
  }
  return 0;
}

std::size_t columns_of(std::string_view text) {
  std::size_t columns = 0;
  for (; !text.empty(); ++columns) text.remove_prefix(first_character(text).bytes.size());
  return columns;
}

std::string cut_columns(std::string_view text, std::size_t columns) {
  std::size_t size = 0;
  for (std::size_t seen = 0; seen < columns && size < text.size(); ++seen)
    size += first_character(text.substr(size)).bytes.size();
  return std::string(text.substr(0, size));
}

std::string visible_text(std::string_view text) { return escaped(text, true); }

std::string visible_line(std::string_view text) { return escaped(text, false); }

bool is_visible(std::string_view text) {
  return is_ascii(text, true) || visible_text(text) == text;
}

}  // namespace sim
