#include "core/engine/temporary.h"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <optional>
#include <string>

#include "core/base/error.h"

using namespace sim;

namespace {

// $TMPDIR as it was, at the end.
class Restored {
 public:
  Restored() {
    if (const char* const value = std::getenv("TMPDIR")) value_ = value;
  }
  ~Restored() {
    if (value_)
      ::setenv("TMPDIR", value_->c_str(), 1);
    else
      ::unsetenv("TMPDIR");
  }

 private:
  std::optional<std::string> value_;
};

}  // namespace

TEST_CASE("a folder for temporary files that does not exist is named", "[base]") {
  const Restored restored;
  ::setenv("TMPDIR", "/", 1);
  CHECK(engine::temporary_folder() == "/");
  ::setenv("TMPDIR", "/nowhere at all", 1);
  try {
    engine::temporary_folder();
    FAIL("no error");
  } catch (const Error& error) {
    CHECK(error.kind() == ErrorKind::kIo);
    CHECK(std::string(error.what()) ==
          "no folder for temporary files: TMPDIR=/nowhere at all: No such file or directory; set "
          "TMPDIR to a folder that you may write to");
  }
}
