// The reserved words of Lua 5.4.
#pragma once

#include <string_view>

namespace sim {

inline constexpr std::string_view kLuaKeywords[] = {
    "and",      "break",  "do",   "else", "elseif", "end",  "false", "for",
    "function", "goto",   "if",   "in",   "local",  "nil",  "not",   "or",
    "repeat",   "return", "then", "true", "until",  "while"};

}  // namespace sim
