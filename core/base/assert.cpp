#include "core/base/assert.h"

#include <cstdio>
#include <cstdlib>

namespace sim {

void assertion_failed(const char* assumed, const char* file, int line) noexcept {
  std::fprintf(stderr, "sim: assertion failed: %s: %s:%d\n", assumed, file, line);
  std::abort();
}

}  // namespace sim
