// Characters of UTF-8.
#include "core/base/utf8.h"

#include <catch2/catch.hpp>

TEST_CASE("the length of a character is looked up in what is given alone") {
  const std::string_view text = "a\xc3\xa9\xe2\x82\xac\xf0\x9f\x8c\x8d";
  CHECK(sim::utf8_length(text) == 1);
  CHECK(sim::utf8_length(text.substr(1)) == 2);
  CHECK(sim::utf8_length(text.substr(3)) == 3);
  CHECK(sim::utf8_length(text.substr(6)) == 4);
  // Nothing, although there is a character behind it, and characters that are cut off.
  CHECK(sim::utf8_length(text.substr(0, 0)) == 0);
  for (const std::size_t size : {1, 2, 3}) CHECK(sim::utf8_length(text.substr(6, size)) == 0);
}
