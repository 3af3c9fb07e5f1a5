#include "core/base/units.h"

#include <string_view>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {
namespace {

[[noreturn]] void refuse_number(const std::string& option, const std::string& text,
                                const std::string& why) {
  throw Error(ErrorKind::kUsage,
              {"bad value", option + " '" + text + "'", why, "write it like 0.005 or 5e-3"});
}

}  // namespace

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

double positive_number(const std::string& option, const std::string& text) {
  const std::optional<double> value = parse_number(text);
  if (!value) refuse_number(option, text, "it is not a finite number");
  if (!(*value > 0)) refuse_number(option, text, "it must be above 0");
  return *value;
}

}  // namespace sim
