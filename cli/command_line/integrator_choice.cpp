#include "cli/command_line/integrator_choice.h"

#include <algorithm>
#include <vector>

#include "cli/command_line/option_values.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

bool has_param(const PluginInfo& plugin, const std::string& name) {
  return std::any_of(plugin.params.begin(), plugin.params.end(),
                     [&](const Param& param) { return param.name == name; });
}

// The text as the declared type says; texts that do not fit stay texts, for Params to refuse.
Value value_of(const std::string& text, const Param& param) {
  switch (param.type) {
    case ParamType::kFlag:
      if (text == "true") return true;
      if (text == "false") return false;
      break;
    case ParamType::kInteger:
      if (const auto integer = parse_integer(text)) return *integer;
      break;
    case ParamType::kNumber:
      if (const auto number = parse_number(text)) return *number;
      break;
    default:
      break;
  }
  return text;
}

// Integrators that have the parameter; those that cannot be opened are passed over.
std::vector<std::string> names_with(const std::string& param, Registry& registry) {
  std::vector<std::string> names;
  for (const std::string& name : registry.names(PluginKind::kIntegrator)) {
    try {
      if (has_param(registry.integrator(name), param)) names.push_back(name);
    } catch (const Error&) {
      continue;
    }
  }
  return names;
}

}  // namespace

IntegratorChoice parse_integrator(const std::string& text) {
  const std::size_t colon = text.find(':');
  IntegratorChoice choice{.name = text.substr(0, colon)};
  if (colon == std::string::npos) return choice;
  const auto refuse = [&](const std::string& why) {
    usage_error("bad value", "--integrator '" + text + "'", why,
                "write it like dopri5:tol=1e-8,max_step=0.1");
  };
  if (choice.name.empty()) refuse("no name stands before the colon");
  for (std::size_t begin = colon + 1;;) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, comma - begin);
    const std::size_t equals = word.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == word.size())
      refuse("'" + word + "' is not PARAM=VALUE");
    if (!choice.params.emplace(word.substr(0, equals), word.substr(equals + 1)).second)
      refuse("'" + word.substr(0, equals) + "' is given twice");
    if (comma == text.size()) return choice;
    begin = comma + 1;
  }
}

std::vector<IntegratorChoice> parse_integrators(const std::string& option,
                                                const std::string& text) {
  std::vector<std::string> parts;
  for (std::string& word : comma_list(option, text)) {
    const bool goes_on = word.find(':') == std::string::npos && word.find('=') != std::string::npos;
    if (goes_on && !parts.empty())
      parts.back() += ',' + word;
    else
      parts.push_back(std::move(word));
  }
  std::vector<IntegratorChoice> choices;
  for (const std::string& part : parts) choices.push_back(parse_integrator(part));
  return choices;
}

std::map<std::string, Value> integrator_values(const IntegratorChoice& choice,
                                               const std::string& name, Registry& registry) {
  try {
    const IntegratorPlugin& plugin = registry.integrator(name, "on the command line");
    const std::string owner = "integrator '" + plugin.name + "'";
    std::map<std::string, Value> given;
    for (const auto& [param, text] : choice.params) {
      const auto declared = std::find_if(plugin.params.begin(), plugin.params.end(),
                                         [&](const Param& each) { return each.name == param; });
      given[param] = declared == plugin.params.end() ? Value(text) : value_of(text, *declared);
    }
    // One that always takes steps of one size needs not be told to.
    if (choice.fixed_step && has_param(plugin, "fixed_step")) given["fixed_step"] = true;
    const auto set = [&](const std::string& param, const std::string& what, const Value& value) {
      if (!has_param(plugin, param))
        usage_error("no " + what + " to set", "--" + param, owner + " has none",
                    "choose one that has: " + join(names_with(param, registry), ", "));
      if (given.count(param))
        usage_error("given twice", "--" + param + " and --integrator " + name + ":" + param + "=",
                    "only one of them can hold", "keep one of them");
      given[param] = value;
    };
    if (choice.tol) set("tol", "tolerance", *choice.tol);
    if (choice.precision) set("precision", "precision", *choice.precision);
    const Params checked(owner, plugin.params, given, "on the command line");
    const bool fixed = has_param(plugin, "fixed_step") && checked.flag("fixed_step");
    for (const char* unused : {"tol", "atol", "rtol"})
      if (fixed && given.count(unused))
        usage_error("a tolerance and steps of one size", owner,
                    std::string("with fixed_step nothing uses ") + unused, "keep one of them");
    return given;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kScene) throw;
    throw Error(ErrorKind::kUsage, error.text());
  }
}

bool same_method(const Settings& settings, const std::string& name,
                 const std::map<std::string, Value>& given) {
  return settings.integrator.name == name &&
         std::ranges::equal(settings.given, given, [](const auto& a, const auto& b) {
           return a.first == b.first && to_text(a.second) == to_text(b.second);
         });
}

}  // namespace sim::cli
