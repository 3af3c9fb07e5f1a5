#include "tests/support/allocations.h"

#include <atomic>
#include <cerrno>

namespace {

std::atomic<std::size_t> allocations{0};

void count() noexcept { allocations.fetch_add(1, std::memory_order_relaxed); }

}  // namespace

namespace sim_test {

std::size_t allocation_count() noexcept { return allocations.load(std::memory_order_relaxed); }

}  // namespace sim_test

#if defined(__has_feature)
#define SIM_TEST_HAS_FEATURE(x) __has_feature(x)
#else
#define SIM_TEST_HAS_FEATURE(x) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    SIM_TEST_HAS_FEATURE(address_sanitizer) || SIM_TEST_HAS_FEATURE(thread_sanitizer)

// The sanitizers replace malloc themselves and call this.
extern "C" __attribute__((visibility("default"))) void __sanitizer_malloc_hook(
    const volatile void* /*memory*/, std::size_t /*size*/) {
  count();
}

#else

// The functions of the C library, replaced for the whole process.
extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

#define SIM_TEST_REPLACES __attribute__((visibility("default")))

SIM_TEST_REPLACES void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}

SIM_TEST_REPLACES void* calloc(std::size_t number, std::size_t size) {
  count();
  return __libc_calloc(number, size);
}

SIM_TEST_REPLACES void* realloc(void* memory, std::size_t size) {
  count();
  return __libc_realloc(memory, size);
}

SIM_TEST_REPLACES void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}

SIM_TEST_REPLACES int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  count();
  *memory = __libc_memalign(alignment, size);
  return *memory ? 0 : ENOMEM;
}

}  // extern "C"

#endif
