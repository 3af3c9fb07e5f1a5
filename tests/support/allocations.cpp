#include "tests/support/allocations.h"

#ifdef SIM_COUNTS_ALLOCATIONS

extern "C" long sim_allocations();  // cli/count_allocations.cpp

namespace sim_test {

std::size_t allocation_count() noexcept { return static_cast<std::size_t>(sim_allocations()); }

}  // namespace sim_test

#else

#include <atomic>

namespace {

std::atomic<std::size_t> allocations{0};

}  // namespace

namespace sim_test {

std::size_t allocation_count() noexcept { return allocations.load(std::memory_order_relaxed); }

}  // namespace sim_test

// The sanitizers replace malloc themselves and call this.
extern "C" __attribute__((visibility("default"))) void __sanitizer_malloc_hook(
    const volatile void* /*memory*/, std::size_t /*size*/) {
  allocations.fetch_add(1, std::memory_order_relaxed);
}

#endif
