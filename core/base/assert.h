// Invariants that the code relies on: checked in debug builds, in fuzzers and under sanitizers, and
// free in release builds.
#pragma once

namespace sim {

// Says what was assumed and where, and ends the program by SIGABRT.
[[noreturn]] void assertion_failed(const char* assumed, const char* file, int line) noexcept;

}  // namespace sim

#ifdef SIM_CHECKED
#define SIM_ASSERT(condition) \
  ((condition) ? void() : ::sim::assertion_failed(#condition, __FILE__, __LINE__))
#else
#define SIM_ASSERT(condition) static_cast<void>(sizeof(!(condition)))
#endif
