// `sim test PLUGIN.so`: checks that a plugin library keeps the contract of the interface.
#pragma once

#include <filesystem>

#include "cli/terminal/console.h"
#include "core/plugin/registry.h"

namespace sim::cli {

struct TestRequest {
  std::filesystem::path library;
  bool json = false;
};

// A table of checks: ok, FAILED or skipped, and the figures or the reason. Returns 7 when one
// failed. Throws Error{kPlugin} for a library that cannot be used. JSON:
// {"library","ok","checks":[{"plugin","check","outcome","words"}]}.
int test_plugin(const TestRequest& request, Registry& registry, Console& console);

}  // namespace sim::cli
