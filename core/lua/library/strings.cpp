// The functions of `string` that look for patterns, or make long strings of short ones.
#include <algorithm>
#include <cctype>
#include <cstring>
#include <limits>

#include "core/lua/library/pattern.h"

namespace sim {
namespace {

constexpr std::size_t kUnitBytes = 64;  // that cost as much as an instruction to copy

std::string_view text_argument(lua_State* L, int argument) {
  std::size_t size = 0;
  const char* const text = luaL_checklstring(L, argument, &size);
  return {text, size};
}

// The start index from 0; a negative argument counts from the end.
std::size_t start_argument(lua_State* L, int argument, std::size_t size) {
  const lua_Integer start = luaL_optinteger(L, argument, 1);
  if (start > 0) return static_cast<std::size_t>(start) - 1;
  if (start == 0 || start < -static_cast<lua_Integer>(size)) return 0;
  return size - static_cast<std::size_t>(-start);
}

int look_for(lua_State* L, bool find) {
  const std::string_view subject = text_argument(L, 1);
  std::string_view pattern = text_argument(L, 2);
  const std::size_t start = start_argument(L, 3, subject.size());
  if (start > subject.size()) {
    lua_pushnil(L);
    return 1;
  }
  constexpr std::string_view kSpecial = "^$*+?.([%-";
  if (find && (lua_toboolean(L, 4) || pattern.find_first_of(kSpecial) == pattern.npos)) {
    charge(L, (subject.size() - start) / kUnitBytes + 1);
    const char* const begin = subject.data() + start;
    const void* const found = memmem(begin, subject.size() - start, pattern.data(), pattern.size());
    if (!found) {
      lua_pushnil(L);
      return 1;
    }
    const auto at = static_cast<const char*>(found) - subject.data();
    lua_pushinteger(L, at + 1);
    lua_pushinteger(L, at + static_cast<lua_Integer>(pattern.size()));
    return 2;
  }
  const bool anchored = pattern.starts_with('^');
  if (anchored) pattern.remove_prefix(1);
  Pattern matcher(L, subject, pattern);
  for (const char* s = subject.data() + start; s <= matcher.end(); ++s) {
    if (const char* const end = matcher.match(s)) {
      if (!find) return matcher.push_captures(s, end);
      lua_pushinteger(L, s - subject.data() + 1);
      lua_pushinteger(L, end - subject.data());
      return 2 + matcher.push_captures(nullptr, nullptr);
    }
    if (anchored) break;
  }
  lua_pushnil(L);
  return 1;
}

int bounded_find(lua_State* L) { return look_for(L, true); }
int bounded_match(lua_State* L) { return look_for(L, false); }

// Upvalues: subject, pattern, where to go on, where the last match ended (-1: none yet).
int next_match(lua_State* L) {
  const std::string_view subject = text_argument(L, lua_upvalueindex(1));
  const lua_Integer last = lua_tointeger(L, lua_upvalueindex(4));
  Pattern matcher(L, subject, text_argument(L, lua_upvalueindex(2)));
  for (const char* s = subject.data() + lua_tointeger(L, lua_upvalueindex(3)); s <= matcher.end();
       ++s) {
    const char* const end = matcher.match(s);
    if (!end || end - subject.data() == last) continue;
    for (const int place : {3, 4}) {
      lua_pushinteger(L, end - subject.data());
      lua_replace(L, lua_upvalueindex(place));
    }
    return matcher.push_captures(s, end);
  }
  return 0;
}

int bounded_gmatch(lua_State* L) {
  const std::string_view subject = text_argument(L, 1);
  text_argument(L, 2);
  const std::size_t start = std::min(start_argument(L, 3, subject.size()), subject.size() + 1);
  lua_settop(L, 2);
  lua_pushinteger(L, static_cast<lua_Integer>(start));
  lua_pushinteger(L, -1);
  lua_pushcclosure(L, next_match, 4);
  return 1;
}

// The text at 3 with its captures, %0 to %9.
void add_replacement(lua_State* L, const Pattern& matcher, const char* begin, const char* end,
                     luaL_Buffer& out) {
  std::string_view text = text_argument(L, 3);
  charge(L, text.size() / kUnitBytes);
  for (std::size_t escape; (escape = text.find('%')) != text.npos;) {
    luaL_addlstring(&out, text.data(), escape);
    const char mark = escape + 1 < text.size() ? text[escape + 1] : '\0';
    if (mark == '%') {
      luaL_addchar(&out, '%');
    } else if (mark == '0') {
      luaL_addlstring(&out, begin, static_cast<std::size_t>(end - begin));
    } else if (std::isdigit(static_cast<unsigned char>(mark))) {
      matcher.push_capture(mark - '1', begin, end);
      luaL_tolstring(L, -1, nullptr);
      lua_remove(L, -2);
      luaL_addvalue(&out);
    } else {
      luaL_error(L, "invalid use of '%%' in replacement string");
    }
    text.remove_prefix(std::min(escape + 2, text.size()));
  }
  luaL_addlstring(&out, text.data(), text.size());
}

// Appends the replacement of one match; the match itself if that is nil or false.
void add_value(lua_State* L, const Pattern& matcher, const char* begin, const char* end,
               luaL_Buffer& out) {
  const int kind = lua_type(L, 3);
  if (kind == LUA_TNUMBER || kind == LUA_TSTRING)
    return add_replacement(L, matcher, begin, end, out);
  if (kind == LUA_TFUNCTION) {
    lua_pushvalue(L, 3);
    lua_call(L, matcher.push_captures(begin, end), 1);
  } else {
    matcher.push_capture(0, begin, end);
    lua_gettable(L, 3);
  }
  if (!lua_toboolean(L, -1)) {
    lua_pop(L, 1);
    luaL_addlstring(&out, begin, static_cast<std::size_t>(end - begin));
  } else if (!lua_isstring(L, -1)) {
    luaL_error(L, "invalid replacement value (a %s)", luaL_typename(L, -1));
  } else {
    luaL_addvalue(&out);
  }
}

int bounded_gsub(lua_State* L) {
  const std::string_view subject = text_argument(L, 1);
  std::string_view pattern = text_argument(L, 2);
  const int kind = lua_type(L, 3);
  luaL_argexpected(
      L, kind == LUA_TNUMBER || kind == LUA_TSTRING || kind == LUA_TFUNCTION || kind == LUA_TTABLE,
      3, "string/function/table");
  const lua_Integer most = luaL_optinteger(L, 4, static_cast<lua_Integer>(subject.size()) + 1);
  const bool anchored = pattern.starts_with('^');
  if (anchored) pattern.remove_prefix(1);
  Pattern matcher(L, subject, pattern);
  luaL_Buffer out;
  luaL_buffinit(L, &out);
  const char *s = subject.data(), *last = nullptr;
  lua_Integer count = 0;
  while (count < most) {
    const char* const end = matcher.match(s);
    if (end && end != last) {
      ++count;
      charge(L, 4);
      add_value(L, matcher, s, end, out);
      s = last = end;
    } else if (s < matcher.end()) {
      luaL_addchar(&out, *s++);
    } else {
      break;
    }
    if (anchored) break;
  }
  luaL_addlstring(&out, s, static_cast<std::size_t>(matcher.end() - s));
  luaL_pushresult(&out);
  lua_pushinteger(L, count);
  return 2;
}

// Copies what is there already, in pieces: s .. between .. s ...
int bounded_rep(lua_State* L) {
  const std::string_view text = text_argument(L, 1);
  const lua_Integer count = luaL_checkinteger(L, 2);
  const std::string_view between = lua_isnoneornil(L, 3) ? "" : text_argument(L, 3);
  const std::size_t unit = text.size() + between.size();
  if (count <= 0 || unit == 0) {
    lua_pushliteral(L, "");
    return 1;
  }
  constexpr std::size_t kLongest = std::numeric_limits<std::ptrdiff_t>::max();
  if (unit < text.size() || unit > kLongest / static_cast<std::size_t>(count))
    return luaL_error(L, "resulting string too large");
  const std::size_t total = unit * static_cast<std::size_t>(count) - between.size();
  luaL_Buffer buffer;
  char* const out = luaL_buffinitsize(L, &buffer, total);
  std::memcpy(out, text.data(), text.size());
  std::size_t done = text.size();
  if (count > 1) {
    std::memcpy(out + done, between.data(), between.size());
    done = unit;
  }
  constexpr std::size_t kPiece = std::size_t{1} << 18;
  while (done < total) {
    // A whole number of units, so that what follows goes on as it began.
    const std::size_t whole = std::max<std::size_t>(1, std::min(done, kPiece) / unit) * unit;
    const std::size_t piece = std::min(whole, total - done);
    std::memcpy(out + done, out, piece);
    done += piece;
    charge(L, piece / kUnitBytes + 1);
  }
  luaL_pushresultsize(&buffer, total);
  return 1;
}

// A number in a format stands for so many bytes of padding.
int bounded_pack(lua_State* L) {
  constexpr std::size_t kMost = 1'000'000;
  std::size_t number = 0;
  for (const char c : text_argument(L, 1)) {
    number = std::isdigit(static_cast<unsigned char>(c))
                 ? 10 * number + static_cast<std::size_t>(c - '0')
                 : 0;
    luaL_argcheck(L, number <= kMost, 1, "a size of more than a million bytes");
  }
  charge(L, 8);
  return call_original(L);
}

// May give back each byte as a value.
int bounded_byte(lua_State* L) {
  const lua_Integer first = luaL_optinteger(L, 2, 1), last = luaL_optinteger(L, 3, first);
  charge(L, first == last ? 1 : text_argument(L, 1).size() / 4 + 1);
  return call_original(L);
}

// Goes through the text once.
int bounded_utf8(lua_State* L) {
  charge(L, text_argument(L, 1).size() / 8 + 1);
  return call_original(L);
}

}  // namespace

void bound_strings(lua_State* L) {
  replace_functions(L, LUA_STRLIBNAME,
                    {{"find", bounded_find},
                     {"match", bounded_match},
                     {"gmatch", bounded_gmatch},
                     {"gsub", bounded_gsub},
                     {"rep", bounded_rep},
                     {"pack", bounded_pack},
                     {"byte", bounded_byte}});
  replace_functions(L, LUA_UTF8LIBNAME,
                    {{"len", bounded_utf8}, {"codepoint", bounded_utf8}, {"offset", bounded_utf8}});
}

}  // namespace sim
