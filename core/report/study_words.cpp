#include "core/report/study_words.h"

#include <algorithm>
#include <cmath>

#include "core/math/elementary.h"
#include "core/output/format.h"

namespace sim::report {

std::optional<study::Quantity> quantity(const SystemSpec& spec, const std::string& text) {
  if (text.empty()) return {};
  return study::Quantity(spec, text);
}

std::string judged_text(const std::string& of, double figure, double error) {
  constexpr double kDigits = 8;
  const double known = error > 0 ? elementary::log10(std::abs(figure) / error) + 1.5 : kDigits;
  const int digits = static_cast<int>(std::clamp(known, 1.0, kDigits));
  return of + (std::isfinite(figure) ? " = " + brief(figure, digits) : "") + " (known to " +
         brief(error, 1) + ")";
}

std::string first_cell(const std::string& name, std::size_t width) {
  if (name.size() <= width) return left(name, width);
  return name + '\n' + std::string(width, ' ');
}

std::string counted(long count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace sim::report
