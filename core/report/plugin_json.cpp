#include "core/report/plugin_json.h"

#include <cmath>
#include <vector>

#include "core/base/text.h"

namespace sim::report {

std::string example_text(const PluginInfo& info) {
  std::vector<std::string> values;
  for (const auto& [name, value] : info.example) {
    const bool text = std::holds_alternative<std::string>(value);
    values.push_back(name + " = " + (text ? json_string(to_text(value)) : to_text(value)));
  }
  return "sim." + std::string(info.kind.name) + "." + info.name + " { " + join(values, ", ") + " }";
}

JsonObject plugin_json(const PluginInfo& info, Registry& registry) {
  std::vector<std::string> params, aliases;
  for (const Param& param : info.params) {
    JsonObject object;
    object.text("name", param.name)
        .text("type", type_name(param.type))
        .text("unit", param.unit)
        .text("default", to_text(param.default_value))
        .flag("required", param.required)
        .flag("per_tie", param.per_tie)
        .text("doc", param.doc);
    std::vector<std::string> choices;
    for (const std::string& choice : param.choices) choices.push_back(json_string(choice));
    if (!choices.empty()) object.json("choices", json_array(choices));
    if (std::isfinite(param.min)) object.number("min", param.min);
    if (std::isfinite(param.max)) object.number("max", param.max);
    params.push_back(object.str());
  }
  for (const std::string& alias : info.aliases) aliases.push_back(json_string(alias));
  JsonObject object;
  object.text("kind", std::string(info.kind.name))
      .text("name", info.name)
      .json("aliases", json_array(aliases))
      .text("summary", info.summary)
      .text("formula", info.formula)
      .text("source", info.source);
  if (const auto facts = integrator_facts(info, registry)) add_facts(object, *facts);
  object.json("params", json_array(params))
      .integer("arity", info.elements.arity)
      .flag("pointwise", info.pointwise)
      .flag("free_numbers", info.free_numbers)
      .text("example", info.example.empty() ? "" : example_text(info))
      .text("file", info.file);
  return object;
}

}  // namespace sim::report
