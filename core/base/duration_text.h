// Durations for people.
#pragma once

#include <string>

namespace sim {

// An estimated time in words: "8 s", "42 s", "3 min", "5 h".
std::string rough_time(double seconds);

}  // namespace sim
