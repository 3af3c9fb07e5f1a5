#include "core/study/budget.h"

#include <optional>

#include "core/base/error.h"
#include "core/base/units.h"

namespace sim::study {

Budget parse_budget(const std::string& option, const std::string& text) {
  constexpr Unit kUnits[] = {{"%", 0.01}, {"um", 1e-6}, {"mm", 1e-3}, {"cm", 0.01}, {"m", 1}};
  const std::optional<double> value = number_in(kUnits, text);
  if (!value || !(*value > 0))
    throw Error(ErrorKind::kUsage,
                {"bad value", option + " '" + text + "'", "expected a share or an amount above 0",
                 "write it like 1%, \"1 mm\" or 1e-3"});
  return {*value, !text.ends_with('%')};
}

}  // namespace sim::study
