// Units in the notation of documents: "N/m", "kg/m^3", "rad/s".
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace sim {

// A product of powers of m, s and kg, times a size; angles are numbers.
struct Dimension {
  std::array<int, 3> power{};  // of m, s and kg
  double size = 1;             // the size of one unit in SI units

  // Sizes that differ by rounding alone are equal.
  friend bool operator==(const Dimension& a, const Dimension& b);
};

// Factors stand behind spaces or '*', and behind '/' each one that is divided by; a power is
// written m2 or m^2. Nothing for a text that is no unit.
std::optional<Dimension> dimension_of(std::string_view text);

}  // namespace sim
