#include "tests/support/skip.h"

#include <catch2/catch.hpp>

#include "core/output/process.h"
#include "tests/cli/program.h"

namespace sim_test {

// Catch2 2.13 has no skip: the listener of main.cpp reads the warning, and the exception with which
// REQUIRE ends a test case ends this one without a failure.
void skip(const std::string& needs, const std::string& package) {
  WARN("skipped: needs " << needs << (package.empty() ? "" : " (Debian: " + package + ")"));
  throw Catch::TestFailureException();
}

void need_program(const std::string& program, const std::string& package) {
  if (sim::find_program(program).empty()) skip(program, package);
}

void need_python(const std::string& module, const std::string& package) {
  need_program("python3", "python3");
  if (run_sim({"-c", "import " + module}, {.program = kPython}).code != 0)
    skip("the Python module " + module, package);
}

}  // namespace sim_test
