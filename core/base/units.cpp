#include "core/base/units.h"

#include <string_view>

#include "core/base/text.h"

namespace sim {

std::optional<double> number_in(std::span<const Unit> units, const std::string& text) {
  std::string digits = text;
  double size = 1;
  for (const Unit& unit : units) {
    if (!text.ends_with(unit.name)) continue;
    digits.resize(text.size() - std::string_view(unit.name).size());
    size = unit.size;
    break;
  }
  while (digits.ends_with(' ')) digits.pop_back();
  const std::optional<double> value = parse_number(digits);
  return value ? std::optional(*value * size) : std::nullopt;
}

}  // namespace sim
