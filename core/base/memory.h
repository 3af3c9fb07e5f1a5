// The available memory, to be checked before much of it is taken.
#pragma once

#include <string>

namespace sim {

// Bytes that this process can still take: of what the machine has available, and its swap; of the
// limit of its control group; of its own address space (RLIMIT_AS). Infinity where none is known.
double memory_left();

std::string bytes_text(double bytes);  // "640 MB", "12.3 GB"

void limit_memory(double bytes);  // that this process may take in all; more is std::bad_alloc

// Throws Error{kIo} with both figures if that much is not available.
void require_memory(double bytes, const std::string& what, const std::string& where,
                    const std::string& remedy);

}  // namespace sim
