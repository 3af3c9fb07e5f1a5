#include "cli/verbs/luacats.h"

#include <algorithm>
#include <map>
#include <sstream>

#include "cli/run/language_docs.h"
#include "cli/verbs/luacats_language.h"
#include "core/base/text.h"

namespace sim::cli {
namespace {

std::string lua_type_of(const Param& param) {
  switch (param.type) {
    case ParamType::kFlag:
      return "boolean";
    case ParamType::kInteger:
      return "integer";
    case ParamType::kNumber:
      return "number";
    case ParamType::kText: {
      std::vector<std::string> choices;
      for (const std::string& choice : param.choices) choices.push_back(json_string(choice));
      return choices.empty() ? "string" : join(choices, "|");
    }
    case ParamType::kVector:
      return "sim.Vector";
    case ParamType::kFunction:
    case ParamType::kParticleFunction:
      return "function";
    case ParamType::kSurface:
      return "sim.Surface";
    case ParamType::kMotion:
      return "sim.motion|fun(t: number): sim.Vector, sim.Vector?";
    case ParamType::kCollider:
      return "sim.collider";
    case ParamType::kColliders:
      return "sim.collider|sim.collider[]";
    case ParamType::kBodies:
      return "sim.Rigid|sim.Rigid[]";
    case ParamType::kCurve:
      return "fun(s: number, t: number): sim.Vector";
    case ParamType::kList:
      return "(number|string)[]|number|string";
    case ParamType::kPath:
      return "sim.Vector|fun(t: number): sim.Vector";
    case ParamType::kLaw:
      return "sim.law";
  }
  return "any";
}

// "stiffness, in N/m, default 1".
std::string meaning(const Param& param) {
  std::string text = param.doc;
  if (!param.unit.empty()) text += ", in " + param.unit;
  if (const std::string value = to_text(param.default_value); !value.empty())
    text += ", default " + value;
  return text;
}

std::string comment(const std::string& text) {
  std::istringstream lines(text);
  std::string result;
  for (std::string line; std::getline(lines, line);) result += "--- " + line + '\n';
  return result;
}

// Keys that are no parameters: ids, particles, the switch.
std::string scene_keys(const PluginInfo& plugin) {
  std::string text;
  const auto key = [&](const std::string& name, const std::string& type) {
    if (std::ranges::count(plugin.params, name, &Param::name) == 0)
      text += "---@field " + name + "? " + type + '\n';
  };
  const bool force = plugin.kind == kind_of<Force>;
  if ((force || plugin.kind == kind_of<Constraint>)&&plugin.elements.arity >= 2)
    key("ties", "table<integer|string, sim.End|number>[]");
  if (plugin.elements.arity == 2) {
    key("grid", "sim.Grid|sim.AddedGrid|(sim.Grid|sim.AddedGrid)[]");
    key("offsets", "integer[][]");
  }
  if (plugin.elements.cells) key("cells", "sim.Cells");
  if (plugin.pointwise || plugin.elements.arity == 1) key("particles", "sim.End[]|sim.Particles");
  if (plugin.kind == kind_of<StepCorrection>) key("surfaces", "sim.Surface[]");
  if (force || plugin.kind == kind_of<Collider>) key("on", "boolean");
  if (plugin.free_numbers) text += "---@field [string] number\n";
  return text;
}

// The options of a plugin: no others are known, unless it takes numbers of any name.
std::string class_of(const PluginInfo& plugin) {
  std::string text = std::string("---@class ") + (plugin.free_numbers ? "" : "(exact) ") + "sim." +
                     std::string(plugin.kind.name) + "." + plugin.name + "\n";
  for (const Param& param : plugin.params) {
    const std::string type = lua_type_of(param) + " " + meaning(param) + '\n';
    const std::string mark = param.required && !param.positional && !param.per_tie ? " " : "? ";
    text += "---@field " + param.name + mark + type;
    if (param.positional) text += "---@field [1]? " + type;
  }
  return text + scene_keys(plugin) + '\n';
}

std::string function_of(const PluginInfo& plugin) {
  const std::string path = "sim." + std::string(plugin.kind.name) + "." + plugin.name;
  return comment(plugin.summary + (plugin.formula.empty() ? "" : "\n" + plugin.formula)) +
         "---@param options? " + path + "\n---@return sim." + std::string(plugin.kind.name) +
         "\nfunction " + path + "(options) end\n\n";
}

std::string language_function(const LanguageFunction& function,
                              const std::map<std::string, std::string>& docs) {
  const auto doc = docs.find(function.name);
  return (doc == docs.end() ? "" : comment(doc->second)) + function.types + "function " +
         function.owner + (function.owner == std::string("sim") ? "." : ":") + function.name + "(" +
         function.arguments + ") end\n\n";
}

}  // namespace

std::string luacats(const Environment& environment, Registry& registry) {
  const std::map<std::string, std::string> docs = language_docs(environment);
  std::string text =
      "---@meta sim\n-- Types of the scene language, written by: sim list --luacats\n\n"
      "local sim = {}\n\n" +
      std::string(kLanguageClasses);
  for (const LanguageFunction& function : language_functions())
    text += language_function(function, docs);
  for (const PluginKind& kind : kPluginKinds) {
    if (!kind.in_scenes) continue;
    const std::string path = "sim." + std::string(kind.name);
    const bool tied = kind == kind_of<Force> || kind == kind_of<Constraint>;
    text += "---@class " + path + (tied ? " : sim.Tied\n" : "\n");
    // sim.contact { ... } is contact of surfaces.
    if (kind == kind_of<StepCorrection>)
      text += "---@overload fun(options: " + path + ".surfaces): " + path + '\n';
    text += path + " = {}\n\n";
    for (const std::string& name : registry.names(kind)) {
      try {
        const PluginInfo& plugin = registry.get(kind, name);
        text += class_of(plugin) + function_of(plugin);
      } catch (const Error&) {
        continue;
      }
    }
  }
  return text + "return sim\n";
}

}  // namespace sim::cli
