// Numbers as people write them, with a unit or without: "5 mm", "1%", "30s", "5e-3".
#pragma once

#include <optional>
#include <span>
#include <string>

namespace sim {

struct Unit {
  const char* name;
  double size;  // of one unit
};

// The number with the first of the units that the text ends with, or without one.
std::optional<double> number_in(std::span<const Unit> units, const std::string& text);

// The number that an option or a variable has been given. Throws Error{kUsage} with its name.
double positive_number(const std::string& option, const std::string& text);

}  // namespace sim
