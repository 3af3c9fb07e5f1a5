#include "cli/verbs/describe.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "cli/run/language_docs.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/format.h"
#include "core/report/plugin_json.h"

namespace sim::cli {
namespace {

using report::example_text, report::integrator_facts, report::IntegratorFacts, report::kind_text;
using report::plugin_json;
using Docs = std::map<std::string, std::string>;

std::string facts_text(const IntegratorFacts& facts) {
  std::string text = "  " + kind_text(facts.info) + ", order " + std::to_string(facts.info.order);
  if (facts.info.evaluations > 0)
    text += ", " + counted(facts.info.evaluations, "evaluation") + " of f a step";
  const auto limit = [](double value, const std::string& what) -> std::string {
    if (std::isnan(value)) return "not known";
    if (std::isinf(value)) return "for every step";
    return value == 0 ? "for no step" : what + " <= " + brief(value);
  };
  return text + "\n  stable: oscillations without drag " +
         limit(facts.oscillation_limit, "while h omega") + ", decays " +
         limit(facts.decay_limit, "while h lambda") + '\n';
}

std::string bounds_text(const Param& param) {
  if (!param.choices.empty()) return join(param.choices, " or ");
  const bool low = std::isfinite(param.min), high = std::isfinite(param.max);
  if (low && high) return "from " + brief(param.min) + " to " + brief(param.max);
  if (low) return "at least " + brief(param.min);
  if (high) return "at most " + brief(param.max);
  return "";
}

std::string default_text(const Param& param) {
  if (param.required) return param.per_tie ? "required, or by tie" : "required";
  const std::string text = to_text(param.default_value);
  return text.empty() ? "none" : text;
}

std::string param_table(const PluginInfo& info) {
  std::vector<std::vector<std::string>> rows{{"name", "type", "unit", "default", "bounds"}};
  for (const Param& param : info.params)
    rows.push_back({param.name, type_name(param.type), param.unit.empty() ? "-" : param.unit,
                    default_text(param), bounds_text(param)});
  std::string table = aligned(rows);
  // The meaning is below its row, so that the table fits a terminal.
  std::string text;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::size_t end = table.find('\n', begin) + 1;
    text += table.substr(begin, end - begin);
    if (i > 0) text += wrapped("      " + info.params[i - 1].doc, 6) + '\n';
    begin = end;
  }
  return text;
}

// The elements of the force in a scene, and the values that each tie may give.
std::string elements_text(const PluginInfo& info) {
  std::string ids, own;
  for (int i = 0; i < info.elements.arity; ++i)
    ids += (i ? ", " : "") + std::string(1, static_cast<char>('a' + i));
  for (const Param& param : info.params)
    if (param.per_tie) own += (own.empty() ? "" : ", ") + param.name + " =";
  if (info.free_numbers) own += own.empty() ? "NAME =" : ", NAME =";
  if (info.elements.arity == 1) return "  acts on particles = { ids }\n";
  std::string text = "joins particles: " + std::string(info.kind.name) + ":tie(" + ids;
  if (!own.empty()) text += ", { " + own + " }";
  text += "), or ties = { {" + ids + (own.empty() ? "" : ", " + own) + "}, ... }";
  if (info.elements.arity == 2) text += ", or grid = and offsets =";
  if (info.elements.cells) text += ", or cells = sim.cells { ... }";
  return wrapped("  " + text, 2) + '\n';
}

std::string plugin_text(const PluginInfo& info, Registry& registry) {
  std::string text = std::string(info.kind.name) + " " + info.name;
  if (!info.aliases.empty()) text += " (also " + join(info.aliases, ", ") + ")";
  text += "\n" + wrapped("  " + info.summary, 2) + '\n';
  if (!info.formula.empty()) text += "\n" + indented(info.formula, "    ");
  if (!info.source.empty()) text += "\n" + wrapped("  source: " + info.source, 10) + '\n';
  if (const auto facts = integrator_facts(info, registry); facts && facts->info.order > 0)
    text += '\n' + facts_text(*facts);
  if (!info.params.empty()) text += "\nparameters\n" + param_table(info);
  if (info.elements.arity > 0) text += '\n' + elements_text(info);
  if (info.pointwise) text += "\nacts on all particles, or on some: particles = {0, 1, 2}\n";
  if (info.free_numbers) text += "\nother names are numbers: NAME = number\n";
  if (!info.example.empty()) text += "\nexample  " + example_text(info) + '\n';
  return text + "\nfile  " + info.file + '\n';
}

std::string plugins_text(const std::vector<const PluginInfo*>& plugins, Registry& registry) {
  std::string text;
  for (const PluginInfo* info : plugins)
    text += (text.empty() ? "" : "\n") + plugin_text(*info, registry);
  return text;
}

// The first one; those of other kinds, if there are any, as its `others`.
std::string plugins_json(const std::vector<const PluginInfo*>& plugins, Registry& registry) {
  JsonObject first = plugin_json(*plugins.front(), registry);
  std::vector<std::string> others;
  for (std::size_t i = 1; i < plugins.size(); ++i)
    others.push_back(plugin_json(*plugins[i], registry).str());
  if (!others.empty()) first.json("others", json_array(others));
  return first.str();
}

std::string scene_text(const LoadedScene& scene, const std::string& name) {
  std::string text = "scene " + name + '\n';
  std::vector<std::vector<std::string>> rows;
  for (const Simulation& system : scene.systems)
    rows.push_back({system.name(), system_facts(system)});
  text += aligned(rows);
  for (const Simulation& system : scene.systems)
    for (const std::string& note : system.integrator().notes())
      text += "\nmethod  " + wrapped((scene.spec.world ? system.name() + ": " : "") + note, 8, 8) +
              '\n';
  if (scene.spec.args.empty()) {
    text += "\nno parameters\n";
  } else {
    text += "\nparameters (--set NAME=VALUE)\n";
    rows = {{"name", "default", "value", "meaning"}};
    for (const SceneArg& arg : scene.spec.args)
      rows.push_back({arg.name, to_text(arg.default_value), to_text(arg.value), arg.doc});
    text += aligned(rows);
  }
  rows = {{"name", "now"}};
  for (const Simulation& system : scene.systems)
    for (const auto& [name_of, on] : system.switches())
      rows.push_back({name_of, on ? "on" : "off"});
  if (rows.size() > 1) text += "\nswitches (--off NAME, .toggle NAME)\n" + aligned(rows);
  for (const SystemSpec& system : scene.spec.systems) {
    std::vector<std::string> names;
    for (const ObserverSpec& observer : system.observers) names.push_back(observer.name);
    if (!names.empty()) text += "\nobserves  " + system.name + ": " + join(names, ", ") + '\n';
  }
  return text + "\nfile  " + scene.spec.file + '\n';
}

std::string scene_json(const LoadedScene& scene, const std::string& name) {
  std::vector<std::string> systems, args;
  for (const Simulation& system : scene.systems) {
    JsonObject object;
    object.text("name", system.name()).integer("order_of_state", system.second_order() ? 2 : 1);
    if (system.flat()) {
      object.integer("components", system.components());
    } else {
      object.integer("particles", system.particles()).integer("pinned", system.pinned_count());
    }
    if (system.second_order()) object.integer("springs", spring_count(system));
    JsonObject switches;
    for (const auto& [name_of, on] : system.switches()) switches.flag(name_of, on);
    object.json("switches", switches.str());
    std::vector<std::string> notes;
    for (const std::string& note : system.integrator().notes()) notes.push_back(json_string(note));
    if (!notes.empty()) object.json("notes", json_array(notes));
    systems.push_back(object.text("integrator", system.method().name())
                          .number("dt", system.h())
                          .number("duration", system.duration())
                          .str());
  }
  for (const SceneArg& arg : scene.spec.args)
    args.push_back(JsonObject()
                       .text("name", arg.name)
                       .text("default", to_text(arg.default_value))
                       .text("value", to_text(arg.value))
                       .text("doc", arg.doc)
                       .str());
  return JsonObject()
      .text("kind", "scene")
      .text("name", name)
      .json("systems", json_array(systems))
      .json("args", json_array(args))
      .text("file", scene.spec.file)
      .str();
}

// The documentation of "sim.grid", "grid" or "particles:pin" in the scene language; nothing if it
// has no such name.
std::optional<std::string> language_doc(const std::string& name, const Docs& docs) {
  const std::size_t before = name.find_last_of(".:");
  const auto doc = docs.find(before == std::string::npos ? name : name.substr(before + 1));
  return doc == docs.end() ? std::nullopt : std::optional(doc->second);
}

// A short name of a scene, or else the nearest of everything that can be described.
std::string remedy_for(const DescribeRequest& request, const std::vector<std::string>& scenes,
                       const Registry& registry, const Docs& docs) {
  const std::string& name = request.name;
  for (const std::string& scene : scenes)
    if (std::filesystem::path(scene).stem() == name) return "did you mean '" + scene + "'?";
  std::vector<std::string> known = scenes;
  for (const PluginKind& kind : kPluginKinds)
    for (const std::string& plugin : registry.names(kind)) known.push_back(plugin);
  for (const auto& [each, doc] : docs) known.push_back(each);
  known.insert(known.end(), request.others.begin(), request.others.end());
  if (const std::string near = nearest(name, known); !near.empty())
    return "did you mean '" + near + "'?";
  return "'sim list' shows all names";
}

// The plugins of a name, which may be as scenes write it: sim.force.spring.
std::vector<const PluginInfo*> plugins_of(const std::string& name, Registry& registry) {
  const std::size_t dot = name.rfind('.');
  if (!name.starts_with("sim.") || dot < 4) return registry.find(name);
  std::vector<const PluginInfo*> plugins = registry.find(name.substr(dot + 1));
  std::erase_if(plugins, [&](const PluginInfo* info) {
    return !info->kind.in_scenes || info->kind.name != name.substr(4, dot - 4);
  });
  return plugins;
}

}  // namespace

std::string system_facts(const Simulation& system) {
  std::string text;
  if (system.flat()) {
    text = counted(system.components(), "number") + ", first order";
  } else if (!system.second_order()) {
    text = counted(system.particles(), "point") + ", first order";
  } else {
    text = counted(system.particles(), "particle");
    if (system.pinned_count() > 0)
      text += " (" + std::to_string(system.pinned_count()) + " pinned)";
    if (system.bodies() > 0)
      text += " of " + std::to_string(system.bodies()) + " rigid " +
              (system.bodies() == 1 ? "body" : "bodies");
    text += ", " + counted(spring_count(system), "spring");
  }
  return text + "; " + system.method().name() + ", " + brief(system.h()) + " s a step, " +
         brief(system.duration()) + " s";
}

int describe(const DescribeRequest& request, const Environment& environment, Registry& registry,
             Console& console) {
  const std::string& name = request.name;
  const bool like_a_file = name.find('/') != std::string::npos || name.ends_with(".lua");
  std::string text;
  std::vector<const PluginInfo*> plugins;
  if (!like_a_file) plugins = plugins_of(name, registry);
  const Docs docs = like_a_file ? Docs() : language_docs(environment);
  const std::optional<std::string> doc = language_doc(name, docs);
  if (!plugins.empty()) {
    text = request.json ? plugins_json(plugins, registry) + "\n"
                        : plugins_text(plugins, registry) + (doc ? "\n" + *doc : "");
  } else if (doc) {
    text = request.json
               ? JsonObject().text("kind", "language").text("name", name).text("doc", *doc).str() +
                     "\n"
               : *doc;
  } else {
    const std::vector<std::string> scenes = list_scenes(environment.scene_folders);
    const bool known = std::find(scenes.begin(), scenes.end(), name) != scenes.end();
    std::error_code error;
    if (!known && !like_a_file && !std::filesystem::is_regular_file(name, error))
      throw Error(ErrorKind::kUsage,
                  {"unknown name", name, "there is no plugin, scene or function of that name",
                   remedy_for(request, scenes, registry, docs)});
    SceneRequest scene_request = request.scene;
    scene_request.scene = name;
    const LoadedScene scene = load(scene_request, environment, registry);
    text = request.json ? scene_json(scene, name) + "\n" : scene_text(scene, name);
  }
  put(console.out, text);
  flush_or_throw(console.out, "standard output");
  return 0;
}

}  // namespace sim::cli
