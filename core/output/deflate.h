// Bytes made smaller, and the checks that formats ask for, by zlib.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace sim {

// A zlib stream (RFC 1950); level 1 (quick) to 9 (small).
std::string deflated(std::string_view bytes, int level = 6);

std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0);

}  // namespace sim
