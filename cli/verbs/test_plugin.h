// `sim test PLUGIN.so`: does a plugin library keep what the interface promises?
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
