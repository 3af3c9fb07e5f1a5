#include "core/base/thread_start.h"

#include <atomic>
#include <cstdio>

namespace sim {

// WebAssembly has none, which surprises nobody.
void warn_of_too_few_threads() {
#if !defined(__wasm__)
  static std::atomic_flag said;
  if (said.test_and_set()) return;
  std::fputs("sim: warning: the system gives no more threads; going on with those there are\n",
             stderr);
#endif
}

}  // namespace sim
