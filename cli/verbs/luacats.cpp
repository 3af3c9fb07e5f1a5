#include "cli/verbs/luacats.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "cli/run/language_docs.h"
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
      return "number[]";
    case ParamType::kFunction:
      return "function";
    case ParamType::kList:
      return "(number|string)[]|number|string";
    default:
      return "any";
  }
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

std::string class_of(const PluginInfo& plugin) {
  std::string text = "---@class sim." + std::string(plugin.kind.name) + "." + plugin.name + "\n";
  for (const Param& param : plugin.params)
    text += "---@field " + param.name + (param.required ? " " : "? ") + lua_type_of(param) + " " +
            meaning(param) + '\n';
  return text + "---@field [string] any\n\n";
}

std::string function_of(const PluginInfo& plugin) {
  const std::string path = "sim." + std::string(plugin.kind.name) + "." + plugin.name;
  return comment(plugin.summary + (plugin.formula.empty() ? "" : "\n" + plugin.formula)) +
         "---@param options? " + path + "\n---@return sim." + std::string(plugin.kind.name) +
         "\nfunction " + path + "(options) end\n\n";
}

bool word(const std::string& text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  });
}

// A function or method of the language: its heading says where it belongs.
std::string language_function(const std::string& name, const std::string& doc) {
  const std::size_t colon = doc.find(':' + name + '(');
  const std::size_t begin = colon == std::string::npos ? 0 : doc.rfind(' ', colon) + 1;
  const std::string owner = colon == std::string::npos ? "" : doc.substr(begin, colon - begin);
  const bool method = word(owner.substr(owner.find('\n') + 1));
  return comment(doc) + "---@return any\n" + (method ? "function Handle:" : "function sim.") +
         name + "(...) end\n\n";
}

}  // namespace

std::string luacats(const Environment& environment, Registry& registry) {
  std::string text =
      "---@meta sim\n-- Types of the scene language, written by: sim list --luacats\n\n"
      "---@class Handle\nlocal Handle = {}\n\nlocal sim = {}\n\n";
  for (const auto& [name, doc] : language_docs(environment))
    if (word(name)) text += language_function(name, doc);
  for (const PluginKind& kind : kPluginKinds) {
    if (!kind.in_scenes) continue;
    const std::string path = "sim." + std::string(kind.name);
    text += "---@class " + path + " : Handle\n" + path + " = {}\n\n";
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
