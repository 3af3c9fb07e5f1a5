#include "core/study/method_text.h"

#include <algorithm>
#include <cctype>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim::study {
namespace {

[[noreturn]] void refuse_method(const std::string& what, const std::string& where,
                                const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {what, where, why, remedy});
}

bool has_param(const PluginInfo& plugin, const std::string& name) {
  return std::any_of(plugin.params.begin(), plugin.params.end(),
                     [&](const Param& param) { return param.name == name; });
}

// The integrators that have the parameter; those that cannot be opened are skipped.
std::vector<std::string> names_with(const std::string& param, Registry& registry) {
  std::vector<std::string> names;
  for (const std::string& name : registry.names<Integrator>()) {
    try {
      if (has_param(registry.get<Integrator>(name), param)) names.push_back(name);
    } catch (const Error&) {
      continue;
    }
  }
  return names;
}

// Names are lower case: RK4 is rk4, unless a plugin is called RK4.
std::string known_name(std::string name, Registry& registry) {
  if (registry.find(kind_of<Integrator>, name)) return name;
  std::string small = name;
  for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return registry.find(kind_of<Integrator>, small) ? small : name;
}

}  // namespace

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

MethodChoice parse_integrator(const std::string& text) {
  const std::size_t colon = text.find(':');
  MethodChoice choice(text.substr(0, colon));
  if (colon == std::string::npos) return choice;
  const auto refuse = [&](const std::string& why) {
    refuse_method("bad value", "--integrator '" + text + "'", why,
                  "write it like dopri5:tol=1e-8,max_step=0.1");
  };
  if (choice.name.empty()) refuse("no name stands before the colon");
  for (std::size_t begin = colon + 1;;) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, comma - begin);
    const std::size_t equals = word.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == word.size())
      refuse("'" + word + "' is not PARAM=VALUE");
    if (!choice.given.emplace(word.substr(0, equals), word.substr(equals + 1)).second)
      refuse("'" + word.substr(0, equals) + "' is given twice");
    if (comma == text.size()) return choice;
    begin = comma + 1;
  }
}

std::vector<MethodChoice> parse_integrators(const std::vector<std::string>& words) {
  std::vector<std::string> parts;
  for (const std::string& word : words) {
    const bool goes_on = word.find(':') == std::string::npos && word.find('=') != std::string::npos;
    if (goes_on && !parts.empty())
      parts.back() += ',' + word;
    else
      parts.push_back(word);
  }
  std::vector<MethodChoice> choices;
  for (const std::string& part : parts) choices.push_back(parse_integrator(part));
  return choices;
}

MethodChoice typed(const MethodChoice& choice, const std::string& name, Registry& registry) {
  try {
    const std::string known = known_name(name, registry);
    const IntegratorPlugin& plugin = registry.get<Integrator>(known, "on the command line");
    MethodChoice result(choice.name == name ? known : choice.name);
    for (const auto& [param, value] : choice.given) {
      const auto declared = std::ranges::find(plugin.params, param, &Param::name);
      const auto* text = std::get_if<std::string>(&value);
      if (declared != plugin.params.end()) {
        result.given[param] = text ? value_of(*text, *declared) : value;
      } else if (param == "precision" || (param == "tol" && !text)) {
        refuse_method(param == "tol" ? "no tolerance to set" : "no precision to set", "--" + param,
                      plugin.title() + " has none",
                      "choose one that has: " + join(names_with(param, registry), ", "));
      } else if (text) {
        result.given[param] = value;  // for Params to refuse
      }  // A method whose steps are all of one size ignores --fixed-step.
    }
    const Method method(registry, plugin, result.given, "on the command line");
    const bool fixed = has_param(plugin, "fixed_step") && method.params().flag("fixed_step");
    for (const char* unused : {"tol", "atol", "rtol"})
      if (fixed && result.given.count(unused))
        refuse_method("a tolerance and steps of one size", plugin.title(),
                      std::string("with fixed_step nothing uses ") + unused, "keep one of them");
    return result;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kScene) throw;
    throw Error(ErrorKind::kUsage, error.text());
  }
}

}  // namespace sim::study
