#include "core/base/array.h"

#include <sys/mman.h>

#include <cstring>
#include <new>

namespace sim {

// The processor fetches ahead within a page only, and looks up the address of each: pages of 2 MiB
// for large arrays save time (core/README.md).
void* zeroed_memory(std::size_t bytes) {
  constexpr std::size_t kCacheLine = 64, kHugePage = std::size_t{1} << 21;
  const bool large = bytes >= kHugePage;
  const std::size_t some = bytes + 1;  // an empty array too has something to point at
  void* memory = nullptr;
  if (posix_memalign(&memory, large ? kHugePage : kCacheLine, some) != 0) throw std::bad_alloc();
  if (large) madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: small pages serve too
  std::memset(memory, 0, bytes);
  return memory;
}

}  // namespace sim
