// Counts every allocation of the process, those of the kernel and its plugins included.
#pragma once

#include <cstddef>

namespace sim_test {

// Calls of malloc and its kin (operator new ends there) since the program started, on all threads.
std::size_t allocation_count() noexcept;

}  // namespace sim_test
