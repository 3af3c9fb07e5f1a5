// The reason why a system call failed, in words for users.
#pragma once

#include <string>

namespace sim {

// True for an error number that is the machine's doing, not that of the file or name in the call:
// no memory, no descriptors, a medium that cannot be read or is full.
bool is_machine_failure(int error);

// The remedy for an error number; empty if nothing general does.
std::string remedy_for(int error);

// The same for a file that cannot be written or a program that cannot be started: the folder and
// its room are to be looked at, unless this process has come to a limit of its own.
std::string remedy_for_writing(int error);

}  // namespace sim
