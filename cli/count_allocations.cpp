// A library preloaded before the C library, as `sim test` does: counts allocations.
#include <atomic>
#include <cerrno>
#include <cstddef>

namespace {

std::atomic<long> allocations{0};

void count() noexcept { allocations.fetch_add(1, std::memory_order_relaxed); }

}  // namespace

#define SIM_EXPORT __attribute__((visibility("default")))

extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

SIM_EXPORT long sim_allocations() { return allocations.load(std::memory_order_relaxed); }

SIM_EXPORT void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}

SIM_EXPORT void* calloc(std::size_t number, std::size_t size) {
  count();
  return __libc_calloc(number, size);
}

SIM_EXPORT void* realloc(void* memory, std::size_t size) {
  count();
  return __libc_realloc(memory, size);
}

SIM_EXPORT void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}

SIM_EXPORT int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  count();
  *memory = __libc_memalign(alignment, size);
  return *memory ? 0 : ENOMEM;
}

}  // extern "C"
