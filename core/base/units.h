// Numbers followed by a unit, as people write them: "5 mm", "1%", "30s".
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

}  // namespace sim
