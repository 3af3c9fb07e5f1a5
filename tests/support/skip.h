// Test cases that cannot run here are skipped by name; they count neither as passed nor as failed.
#pragma once

#include <string>

namespace sim_test {

// Ends the test case, which counts as skipped; the package of Debian brings what it needs.
[[noreturn]] void skip(const std::string& needs, const std::string& package);

// Skips the test case unless this program of another package is in the PATH.
void need_program(const std::string& program, const std::string& package);

// Skips the test case unless python3 imports this module.
void need_python(const std::string& module, const std::string& package);

inline constexpr const char* kPython = "/usr/bin/python3";

}  // namespace sim_test
