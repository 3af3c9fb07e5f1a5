// Text of UTF-8 as wide characters, and back.
#pragma once

#include <string>
#include <string_view>

namespace sim::cli {

// Bytes that are no UTF-8 become U+FFFD.
std::wstring wide_text(std::string_view text);

std::string narrow_text(std::wstring_view wide);

}  // namespace sim::cli
