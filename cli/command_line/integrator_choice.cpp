#include "cli/command_line/integrator_choice.h"

#include "cli/command_line/option_values.h"

namespace sim::cli {

std::vector<MethodChoice> parse_integrators(const std::string& option, const std::string& text) {
  return study::parse_integrators(comma_list(option, text));
}

void add_options(MethodChoice& choice, const std::string& tol, const std::string& precision,
                 bool fixed_step) {
  const auto add = [&](const std::string& param, const Value& value) {
    if (!choice.given.emplace(param, value).second)
      usage_error("given twice",
                  "--" + param + " and --integrator " + choice.name + ":" + param + "=",
                  "only one of them can hold", "keep one of them");
  };
  if (!tol.empty()) add("tol", positive_number("--tol", tol));
  if (!precision.empty()) add("precision", precision);
  if (fixed_step) choice.given["fixed_step"] = true;
}

}  // namespace sim::cli
