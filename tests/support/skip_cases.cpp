// Test cases that skip_test.cpp runs in a process of their own.
#include <catch2/catch.hpp>

#include "tests/support/skip.h"

using sim_test::skip;

TEST_CASE("a unicorn is fed", "[.][unicorn][unicorns]") {
  skip("a unicorn", "unicorn oats");
  FAIL("a skipped case went on");
}

TEST_CASE("a horse is fed", "[.][unicorns]") { CHECK(true); }

TEST_CASE("a cow is fed", "[.][unicorns]") {
  CHECK(false);
  skip("hay", "");
}
