#include "core/output/page/markup.h"

#include <algorithm>
#include <cstdint>

namespace sim {
namespace {

// A byte as \x1b.
void append_byte(std::string& out, char byte) {
  constexpr std::string_view kHex = "0123456789abcdef";
  const auto value = static_cast<unsigned char>(byte);
  out += "\\x";
  out += kHex[value >> 4];
  out += kHex[value & 15];
}

// The bytes of the UTF-8 character at the start, 0 if there is none or XML does not allow it.
std::size_t character_size(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return byte(0) >= 0x20 && byte(0) != 0x7f ? 1 : 0;
  const std::size_t size = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
  if (byte(0) < 0xc2 || byte(0) > 0xf4 || text.size() < size) return 0;
  std::uint32_t code = byte(0) & (0xffU >> (size + 1));
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3fU);
  }
  constexpr std::uint32_t kLeast[] = {0, 0, 0xa0, 0x800, 0x10000};  // the controls of C1 are below
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  return code < kLeast[size] || surrogate || code > 0x10ffff || (code & 0xfffeU) == 0xfffe ? 0
                                                                                           : size;
}

std::string_view entity(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return "";
  }
}

}  // namespace

std::string markup_text(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    std::size_t size = text[0] == '\n' || text[0] == '\t' ? 1 : character_size(text);
    if (size == 0) {
      append_byte(out, text[0]);
      size = 1;
    } else if (const std::string_view replacement = entity(text[0]); !replacement.empty()) {
      out += replacement;
    } else {
      out += text.substr(0, size);
    }
    text.remove_prefix(size);
  }
  return out;
}

// These characters occur in the strings of JSON alone.
std::string script_json(std::string_view json) {
  constexpr std::pair<std::string_view, std::string_view> kEscapes[] = {
      {"<", "\\u003c"},
      {">", "\\u003e"},
      {"&", "\\u0026"},
      {"\xe2\x80\xa8", "\\u2028"},  // ends a line of a script
      {"\xe2\x80\xa9", "\\u2029"}};
  std::string out;
  while (!json.empty()) {
    const auto escape = std::ranges::find_if(
        kEscapes, [&](const auto& each) { return json.starts_with(each.first); });
    if (escape == std::end(kEscapes)) {
      out += json.front();
      json.remove_prefix(1);
    } else {
      out += escape->second;
      json.remove_prefix(escape->first.size());
    }
  }
  return out;
}

std::string fill_placeholders(std::string_view page, const std::vector<PlaceholderValue>& values) {
  std::string out;
  for (;;) {
    const std::size_t begin = std::min(page.find('@'), page.size());
    const std::size_t end = page.find('@', std::min(begin + 1, page.size()));
    out += page.substr(0, begin);
    if (end == std::string_view::npos) return out.append(page.substr(begin));
    const std::string_view name = page.substr(begin + 1, end - begin - 1);
    const auto value = std::ranges::find(values, name, &PlaceholderValue::first);
    if (value == values.end()) {
      out += '@';
      page.remove_prefix(begin + 1);
    } else {
      out += value->second;
      page.remove_prefix(end + 1);
    }
  }
}

}  // namespace sim
