#include "cli/verbs/reference_page.h"

#include <algorithm>

#include "cli/run/language_docs.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace sim::cli {
namespace {

std::string in_table(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  for (std::size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2))
    text.insert(at, "\\");
  return text;
}

std::string params_table(const PluginInfo& plugin) {
  std::string text = "| parameter | unit | default | meaning |\n|---|---|---|---|\n";
  for (const Param& param : plugin.params) {
    std::string value = param.required ? "required" : to_text(param.default_value);
    if (!param.choices.empty()) value += " (" + join(param.choices, ", ") + ")";
    if (param.per_tie) value += "; by tie";
    text += "| `" + param.name + "` | " + param.unit + " | " + in_table(value) + " | " +
            in_table(param.doc) + " |\n";
  }
  return text;
}

std::string plugin_section(const PluginInfo& plugin) {
  std::string text = "### sim." + std::string(plugin.kind.name) + "." + plugin.name + "\n\n" +
                     plugin.summary + ".";
  if (!plugin.aliases.empty()) text += " Also: `" + join(plugin.aliases, "`, `") + "`.";
  text += "\n\n";
  if (!plugin.formula.empty()) text += "```text\n" + plugin.formula + "\n```\n\n";
  if (!plugin.source.empty()) text += "Source: " + plugin.source + ".\n\n";
  if (!plugin.params.empty()) text += params_table(plugin) + "\n";
  return text;
}

// "sim.grid", or ":pin" of a method, as named in the first lines of the documentation.
std::string heading_of(const std::string& name, const std::string& doc) {
  const bool method = doc.find(':' + name) < doc.find('\n');
  return (method ? ":" : "sim.") + name;
}

}  // namespace

std::string reference_page(const Environment& environment, Registry& registry) {
  std::string text = "## Functions\n\n";
  std::string last;
  // One comment may explain several names.
  for (const auto& [name, doc] : language_docs(environment)) {
    if (doc == last) continue;
    last = doc;
    text += "### " + heading_of(name, doc) + "\n\n```text\n" + doc + "```\n\n";
  }
  for (const PluginKind& kind : kPluginKinds) {
    const std::vector<std::string> names = registry.names(kind);
    if (names.empty() || !kind.in_scenes) continue;
    text += "## sim." + std::string(kind.name) + "\n\n";
    for (const std::string& name : names) {
      try {
        text += plugin_section(registry.get(kind, name));
      } catch (const Error&) {
        continue;
      }
    }
  }
  return text;
}

}  // namespace sim::cli
