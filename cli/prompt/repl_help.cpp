#include "cli/prompt/repl_help.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "cli/prompt/repl_commands.h"
#include "cli/run/language_docs.h"
#include "cli/verbs/describe.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

constexpr std::size_t kUseWidth = 24;

std::string use_of(const Command& command) {
  return std::string(".") + command.name + (*command.arguments ? " " : "") + command.arguments;
}

std::string help_on_command(const Command& command) {
  return use_of(command) + "\n  " + command.help + "\n  in Lua: sim." + command.lua + "(...)\n";
}

// The last part of sim.force.spring, .step or grid:pin.
std::string last_name(std::string name) {
  while (name.ends_with('?') || name.ends_with(' ')) name.pop_back();
  const std::size_t dot = name.find_last_of(".:");
  const bool file = name.find('/') != std::string::npos || name.ends_with(".lua");
  return dot == std::string::npos || file ? name : name.substr(dot + 1);
}

std::vector<std::string> plugin_names(const Registry& registry) {
  std::vector<std::string> names;
  for (const PluginKind& kind : kPluginKinds)
    for (const std::string& name : registry.names(kind)) names.push_back(name);
  return names;
}

}  // namespace

std::string help_list() {
  std::string text = "Lua with the scene in it: sim.step(100)  x = position(12)  energy().total\n";
  std::string section;
  for (const Command& command : commands()) {
    if (section != command.section) text += std::string("\n") + command.section + "\n";
    section = command.section;
    text +=
        wrapped("  " + left(use_of(command), kUseWidth - 1) + " " + command.help, kUseWidth + 2) +
        "\n";
  }
  return text +
         "\nA command may be shortened while it is clear; each is a function: sim.step(9)\n"
         "NAME? tells about a command, a function of the scene language or a plugin.\n"
         "_ is the last value. Tab completes, Ctrl-R searches, Ctrl-C stops, Ctrl-D ends.\n";
}

std::string help_on(Session& session, const std::string& asked) {
  const std::string name = last_name(asked);
  const bool dotted = asked.starts_with('.');
  std::vector<std::string> known;
  for (const Command& command : commands()) known.emplace_back(command.name);
  const auto docs = language_docs(session.environment());
  std::string text;
  if (dotted) {
    text = help_on_command(find_command(name));
  } else if (const Command* command = command_called(name)) {
    text = help_on_command(*command);
  }
  if (const auto doc = docs.find(name); doc != docs.end() && !dotted)
    text += (text.empty() ? "" : "\n") + doc->second;
  const bool scene = name.ends_with(".lua") || name.find('/') != std::string::npos;
  if (!dotted && (scene || !session.registry().find(name).empty())) {
    std::ostringstream out;
    Console console{out, session.console().err, false};
    DescribeRequest request{name, session.live().request(), false};
    if (request.name != request.scene.scene) request.scene.settings.clear();
    describe(request, session.environment(), session.registry(), console);
    text += (text.empty() ? "" : "\n") + out.str();
  }
  if (!text.empty()) return text;
  for (const auto& [each, doc] : docs) known.push_back(each);
  for (const std::string& plugin : plugin_names(session.registry())) known.push_back(plugin);
  const std::string near = nearest(name, known);
  throw Error(ErrorKind::kUsage,
              {"no help on '" + name + "'", "",
               "there is no command, function of the scene language or plugin of that name",
               near.empty() ? ".help lists the commands" : "did you mean '" + near + "'?"});
}

namespace {

// The possible first arguments of a command.
Completions arguments_of(Session& session, const std::string& command) {
  LiveScene& live = session.live();
  if (command == "integrator" || command == "order" || command == "stability")
    return {session.registry().names<Integrator>()};
  if (command == "system") return {live.scene().names()};
  if (command == "mode") return {{"text", "json", "csv"}};
  if (command == "plugins") {
    Completions found{{"scenes"}};
    for (const PluginKind& kind : kPluginKinds) found.words.emplace_back(kind.folder);
    return found;
  }
  Completions found;
  if (command == "switch" || command == "diff")
    for (const auto& [name, branch] : live.branches()) found.words.push_back(name);
  if (command == "set")
    for (const SceneArg& arg : live.scene().spec.args) found.words.push_back(arg.name);
  if (command == "help") {
    for (const Command& each : commands()) found.words.emplace_back(each.name);
    for (const std::string& name : plugin_names(session.registry())) found.words.push_back(name);
  }
  if (command == "plot")
    for (const Records::Record& each : session.records.all())
      found.words.push_back(each.series.name);
  if (command == "open") found.words = list_scenes(session.environment().scene_folders);
  constexpr std::string_view kFiles[] = {"snap", "resume", "dump", "read", "open", "load", "save"};
  found.files = std::ranges::count(kFiles, command) > 0;
  return found;
}

// Names of Lua, and those after sim. and sim.KIND. that look like fields.
std::vector<std::string> lua_names(Session& session, const std::string& path) {
  std::vector<std::string> names = session.lua().completions(path);
  for (const PluginKind& kind : kPluginKinds)
    if (const std::string prefix = "sim." + std::string(kind.name) + "."; path.starts_with(prefix))
      for (const std::string& name : session.registry().names(kind)) names.push_back(prefix + name);
  if (path.starts_with("sim.") && path.find('.', 4) == std::string::npos) {
    for (const char* name : {"arg", "box", "capsule", "cells", "compound", "contact", "grid",
                             "mesh", "particles", "rigid", "scene", "sphere", "surface", "world"})
      names.push_back(std::string("sim.") + name);
    for (const PluginKind& kind : kPluginKinds)
      if (kind.in_scenes) names.push_back("sim." + std::string(kind.name));
  }
  return names;
}

}  // namespace

Completions complete(Session& session, const std::string& line, std::size_t word_begin) {
  const std::string word = line.substr(word_begin);
  Completions found;
  const std::size_t start = line.find_first_not_of(' ');
  const bool command = start != std::string::npos && line[start] == '.';
  if (command && word_begin <= start + 1) {
    const std::string dot = word.starts_with('.') ? "." : "";
    for (const Command& each : commands()) found.words.push_back(dot + each.name);
  } else if (command) {
    const std::string name = line.substr(start + 1, line.find(' ', start) - start - 1);
    const Command* called = nullptr;
    try {
      called = &find_command(name);
    } catch (const Error&) {
      return {};
    }
    if (!called->whole_line)
      found = arguments_of(session, called->name);
    else
      found.words = lua_names(session, word);
  } else {
    found.words = lua_names(session, word);
  }
  std::erase_if(found.words, [&](const std::string& name) { return !name.starts_with(word); });
  std::sort(found.words.begin(), found.words.end());
  found.words.erase(std::unique(found.words.begin(), found.words.end()), found.words.end());
  return found;
}

}  // namespace sim::cli
