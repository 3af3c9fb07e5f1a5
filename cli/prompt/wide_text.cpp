#include "cli/prompt/wide_text.h"

#include "core/base/utf8.h"

namespace sim::cli {

std::wstring wide_text(std::string_view text) {
  std::wstring wide;
  while (!text.empty()) {
    const Character first = first_character(text);
    wide += static_cast<wchar_t>(first.code.value_or(0xfffd));
    text.remove_prefix(first.bytes.size());
  }
  return wide;
}

std::string narrow_text(std::wstring_view wide) {
  std::string text;
  // Every byte behind the first has six bits of the code.
  const auto append = [&](char32_t code, unsigned lead, int more) {
    text += static_cast<char>(lead | code >> (6 * more));
    while (more-- > 0) text += static_cast<char>(0x80 | (code >> (6 * more) & 0x3f));
  };
  for (const wchar_t character : wide) {
    const auto code = static_cast<char32_t>(character);
    if (code < 0x80)
      append(code, 0, 0);
    else if (code < 0x800)
      append(code, 0xc0, 1);
    else if (code < 0x10000)
      append(code, 0xe0, 2);
    else if (code < 0x110000)
      append(code, 0xf0, 3);
  }
  return text;
}

}  // namespace sim::cli
