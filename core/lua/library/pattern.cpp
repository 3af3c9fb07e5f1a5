#include "core/lua/library/pattern.h"

#include <cctype>
#include <cstring>

namespace sim {
namespace {

constexpr char kEscape = '%';

// Is c of the class that a letter names? A capital letter names all others.
bool class_has(unsigned char c, unsigned char letter) {
  bool has = false;
  switch (std::tolower(letter)) {
    case 'a':
      has = std::isalpha(c);
      break;
    case 'c':
      has = std::iscntrl(c);
      break;
    case 'd':
      has = std::isdigit(c);
      break;
    case 'g':
      has = std::isgraph(c);
      break;
    case 'l':
      has = std::islower(c);
      break;
    case 'p':
      has = std::ispunct(c);
      break;
    case 's':
      has = std::isspace(c);
      break;
    case 'u':
      has = std::isupper(c);
      break;
    case 'w':
      has = std::isalnum(c);
      break;
    case 'x':
      has = std::isxdigit(c);
      break;
    case 'z':
      has = c == '\0';
      break;
    default:
      return letter == c;
  }
  return std::isupper(letter) ? !has : has;
}

unsigned char byte(const char* at) { return static_cast<unsigned char>(*at); }

}  // namespace

struct Pattern::Deeper {
  explicit Deeper(Pattern& owner) : pattern(owner) {
    if (++pattern.depth_ > kDeepest) luaL_error(pattern.L_, "pattern too complex");
  }
  ~Deeper() { --pattern.depth_; }
  Pattern& pattern;
};

Pattern::Pattern(lua_State* L, std::string_view subject, std::string_view pattern)
    : L_(L),
      budget_(LuaBudget::of(L)),
      begin_(subject.data()),
      end_(subject.data() + subject.size()),
      pattern_(pattern.data()),
      pattern_end_(pattern.data() + pattern.size()) {}

const char* Pattern::match(const char* at) {
  captures_ = depth_ = 0;
  return go(at, pattern_);
}

// Matches the item at p against s greedily, and the rest of the pattern after it.
const char* Pattern::go(const char* s, const char* p) {
  const Deeper deeper(*this);
  while (s && p != pattern_end_) {
    work();
    const char next = p + 1 < pattern_end_ ? p[1] : '\0';
    if (*p == '(') return next == ')' ? open(s, p + 2, kPlace) : open(s, p + 1, kOpen);
    if (*p == ')') return close(s, p + 1);
    if (*p == '$' && p + 1 == pattern_end_) return s == end_ ? s : nullptr;
    if (*p == kEscape && next == 'b') {
      s = balanced(s, p + 2);
      p += 4;
      continue;
    }
    if (*p == kEscape && next == 'f') {
      p += 2;
      if (p >= pattern_end_ || *p != '[') luaL_error(L_, "missing '[' after '%%f' in pattern");
      const char* const behind = item_end(p);
      const unsigned char left = s == begin_ ? '\0' : byte(s - 1);
      const unsigned char right = s == end_ ? '\0' : byte(s);
      if (set_has(left, p, behind - 1) || !set_has(right, p, behind - 1)) return nullptr;
      p = behind;
      continue;
    }
    if (*p == kEscape && std::isdigit(static_cast<unsigned char>(next))) {
      s = again(s, next);
      p += 2;
      continue;
    }
    const char* const behind = item_end(p);
    const char mark = behind < pattern_end_ ? *behind : '\0';
    const bool optional = mark == '*' || mark == '-' || mark == '?';
    if (!item_has(s, p, behind)) {
      if (!optional) return nullptr;
      p = behind + 1;
      continue;
    }
    if (mark == '*') return most_first(s, p, behind);
    if (mark == '+') return most_first(s + 1, p, behind);
    if (mark == '-') return least_first(s, p, behind);
    if (mark == '?')
      if (const char* const rest = go(s + 1, behind + 1)) return rest;
    if (mark != '?') ++s;
    p = behind + optional;
  }
  return s;
}

const char* Pattern::most_first(const char* s, const char* p, const char* behind) {
  std::ptrdiff_t count = 0;
  for (; item_has(s + count, p, behind); ++count) work();
  for (; count >= 0; --count) {
    work();
    if (const char* const rest = go(s + count, behind + 1)) return rest;
  }
  return nullptr;
}

const char* Pattern::least_first(const char* s, const char* p, const char* behind) {
  for (;; ++s) {
    work();
    if (const char* const rest = go(s, behind + 1)) return rest;
    if (!item_has(s, p, behind)) return nullptr;
  }
}

const char* Pattern::open(const char* s, const char* p, std::ptrdiff_t kind) {
  if (captures_ >= kMostCaptures) luaL_error(L_, "too many captures");
  capture_[captures_++] = {s, kind};
  const char* const rest = go(s, p);
  if (!rest) --captures_;
  return rest;
}

// Closes the last open capture.
const char* Pattern::close(const char* s, const char* p) {
  int index = captures_ - 1;
  while (index >= 0 && capture_[index].length != kOpen) --index;
  if (index < 0) luaL_error(L_, "invalid pattern capture");
  capture_[index].length = s - capture_[index].at;
  const char* const rest = go(s, p);
  if (!rest) capture_[index].length = kOpen;
  return rest;
}

const char* Pattern::balanced(const char* s, const char* p) const {
  if (p + 1 >= pattern_end_) luaL_error(L_, "malformed pattern (missing arguments to '%%b')");
  if (s == end_ || *s != p[0]) return nullptr;
  for (int level = 1; ++s < end_;) {
    budget_.charge(L_, 1);
    if (*s == p[1]) {
      if (--level == 0) return s + 1;
    } else if (*s == p[0]) {
      ++level;
    }
  }
  return nullptr;
}

// Matches the text of an earlier capture again.
const char* Pattern::again(const char* s, char digit) const {
  const int index = digit - '1';
  if (index < 0 || index >= captures_ || capture_[index].length == kOpen)
    luaL_error(L_, "invalid capture index %%%d", index + 1);
  // A place counts as a text of no length that is too long for any subject.
  const auto length = static_cast<std::size_t>(capture_[index].length);
  if (static_cast<std::size_t>(end_ - s) < length) return nullptr;
  budget_.charge(L_, length / 64);
  return std::memcmp(capture_[index].at, s, length) == 0 ? s + length : nullptr;
}

const char* Pattern::item_end(const char* p) const {
  const char first = *p++;
  if (first == kEscape) {
    if (p == pattern_end_) luaL_error(L_, "malformed pattern (ends with '%%')");
    return p + 1;
  }
  if (first != '[') return p;
  if (p < pattern_end_ && *p == '^') ++p;
  do {  // a ] that stands first is of the set
    if (p == pattern_end_) luaL_error(L_, "malformed pattern (missing ']')");
    if (*p++ == kEscape && p < pattern_end_) ++p;
  } while (p == pattern_end_ || *p != ']');
  return p + 1;
}

bool Pattern::item_has(const char* s, const char* p, const char* behind) const {
  if (s >= end_) return false;
  switch (*p) {
    case '.':
      return true;
    case kEscape:
      return class_has(byte(s), byte(p + 1));
    case '[':
      return set_has(byte(s), p, behind - 1);
    default:
      return *p == *s;
  }
}

// `set` is at its [ and `bracket` at its ].
bool Pattern::set_has(unsigned char c, const char* set, const char* bracket) const {
  budget_.charge(L_, static_cast<std::uint64_t>(bracket - set) / 16);
  const char* p = set + 1;
  const bool wanted = *p != '^';
  if (!wanted) ++p;
  for (; p < bracket; ++p) {
    if (*p == kEscape) {
      if (class_has(c, byte(++p))) return wanted;
    } else if (p + 2 < bracket && p[1] == '-') {
      if (byte(p) <= c && c <= byte(p + 2)) return wanted;
      p += 2;
    } else if (byte(p) == c) {
      return wanted;
    }
  }
  return !wanted;
}

void Pattern::push_capture(int index, const char* begin, const char* end) const {
  if (index >= captures_) {
    if (index != 0) luaL_error(L_, "invalid capture index %%%d", index + 1);
    lua_pushlstring(L_, begin, static_cast<std::size_t>(end - begin));
    return;
  }
  const Capture& capture = capture_[index];
  if (capture.length == kOpen) luaL_error(L_, "unfinished capture");
  if (capture.length == kPlace)
    lua_pushinteger(L_, capture.at - begin_ + 1);
  else
    lua_pushlstring(L_, capture.at, static_cast<std::size_t>(capture.length));
}

int Pattern::push_captures(const char* begin, const char* end) const {
  const int count = captures_ == 0 && begin ? 1 : captures_;
  luaL_checkstack(L_, count, "too many captures");
  for (int i = 0; i < count; ++i) push_capture(i, begin, end);
  return count;
}

}  // namespace sim
