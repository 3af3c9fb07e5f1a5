// Names of fields by their digests, and what other code throws.
#include "core/session/fields.h"

#include <catch2/catch.hpp>
#include <new>
#include <stdexcept>
#include <string>

#include "core/base/error.h"
#include "core/base/thrown.h"

using namespace sim;

// Fowler, Noll & Vo, draft-eastlake-fnv: FNV-1a of 64 bits.
TEST_CASE("names of fields have the digests of FNV-1a") {
  const std::pair<std::string, std::uint64_t> digests[] = {{"", 0xcbf29ce484222325},
                                                           {"a", 0xaf63dc4c8601ec8c},
                                                           {"b", 0xaf63df4c8601f1a5},
                                                           {"foobar", 0x85944171f73967e8}};
  for (const auto& [name, digest] : digests) CHECK(StructField{name.c_str()}.hash() == digest);
}

TEST_CASE("exceptions of others are words, our own and those of memory stay what they are") {
  const auto caught = [](auto thrown) -> std::optional<std::string> {
    try {
      throw thrown;
    } catch (...) {
      return thrown_by_others();
    }
  };
  CHECK(caught(std::runtime_error("it broke")) == "it broke");
  CHECK_FALSE(caught(7));
  CHECK_THROWS_AS(caught(Error(ErrorKind::kScene, {"a", "b", "c", "d"})), Error);
  CHECK_THROWS_AS(caught(std::bad_alloc()), std::bad_alloc);
}
