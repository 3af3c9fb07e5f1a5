// The MD5 checksum (Rivest 1992, RFC 1321): against damage, not against an enemy.
#pragma once

#include <string>
#include <string_view>

namespace sim {

// 32 hexadecimal digits.
std::string md5(std::string_view bytes);

}  // namespace sim
