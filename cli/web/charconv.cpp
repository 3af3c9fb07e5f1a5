// Numbers as text by the rules of <charconv>, from printf and strtod of the C library, which are
// exact: what the C++ library of emscripten does not have.
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace std {

// The longest beginning that is a number, without a sign + and without blanks before it.
from_chars_result from_chars(const char* first, const char* last, double& value, chars_format) {
  const char* at = first;
  if (at != last && *at == '-') ++at;
  const auto digit = [&] { return at != last && *at >= '0' && *at <= '9'; };
  const auto is_word = [&](const char* word) {
    const auto length = static_cast<ptrdiff_t>(strlen(word));
    return last - at >= length && strncasecmp(at, word, static_cast<size_t>(length)) == 0;
  };
  const char* end = first;
  if (is_word("infinity")) {
    end = at + 8;
  } else if (is_word("inf") || is_word("nan")) {
    end = at + 3;
  } else {
    const char* const begin = at;
    while (digit()) ++at;
    ptrdiff_t digits = at - begin;
    if (at != last && *at == '.') {
      const char* const point = at++;
      while (digit()) ++at;
      digits += at - point - 1;
    }
    if (digits > 0) end = at;
    if (digits > 0 && at != last && (*at == 'e' || *at == 'E')) {
      ++at;
      if (at != last && (*at == '+' || *at == '-')) ++at;
      const bool exponent = digit();
      while (digit()) ++at;
      if (exponent) end = at;
    }
  }
  if (end == first) return {first, errc::invalid_argument};
  const double read = strtod(string(first, end).c_str(), nullptr);
  const bool finite = read - read == 0, word = end[-1] > '9';
  const bool zero = read == 0 && strpbrk(string(first, end).c_str(), "123456789") != nullptr;
  if ((!finite && !word) || zero) return {end, errc::result_out_of_range};
  value = read;
  return {end, errc()};
}

namespace {

to_chars_result put(char* first, char* last, const string& text) {
  if (static_cast<ptrdiff_t>(text.size()) > last - first) return {last, errc::value_too_large};
  memcpy(first, text.data(), text.size());
  return {first + text.size(), errc()};
}

string printed(const char* format, int digits, double value) {
  char text[512];
  const int length = snprintf(text, sizeof text, format, digits, value);
  return {text, static_cast<size_t>(length)};
}

}  // namespace

inline namespace __2 {

// The fewest digits that give the number again; fixed or scientific, whichever is shorter, and
// fixed where they are equal.
to_chars_result to_chars(char* first, char* last, double value) {
  if (!(value - value == 0)) return put(first, last, printed("%.*f", 0, value));
  string scientific;
  int digits = 0;
  do scientific = printed("%.*e", digits, value);
  while (strtod(scientific.c_str(), nullptr) != value && ++digits < 17);
  const int exponent = atoi(scientific.c_str() + scientific.find('e') + 1);
  const int decimals = digits > exponent ? digits - exponent : 0;
  const string fixed = printed("%.*f", decimals, value);
  return put(first, last, fixed.size() <= scientific.size() ? fixed : scientific);
}

to_chars_result to_chars(char* first, char* last, double value, chars_format, int digits) {
  return put(first, last, printed("%.*g", digits, value));
}

[[noreturn]] void __libcpp_verbose_abort(const char* format, ...) {
  fputs(format, stderr);
  abort();
}

}  // namespace __2
}  // namespace std
