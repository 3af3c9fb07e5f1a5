// The reason why a system call failed, in words for users.
#pragma once

#include <string>

namespace sim {

// True for an error number caused by the machine, not by the file or name in the call: no memory,
// no descriptors, a medium that cannot be read or is full.
bool is_machine_failure(int error);

// The remedy for an error number; empty if nothing general does.
std::string remedy_for(int error);

// The same for a file that cannot be written or a program that cannot be started: it names the
// folder and its free space, unless this process has reached a limit of its own.
std::string remedy_for_writing(int error);

}  // namespace sim
