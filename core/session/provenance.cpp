#include "core/session/provenance.h"

#include <algorithm>
#include <set>

#include "core/plugin/registry.h"
#include "core/scene/scene_spec.h"

namespace sim {
namespace {

using Files = std::map<std::string, std::set<std::uint64_t>>;  // contents under one name

// Paths that were searched in vain have no contents.
Files by_name(const std::vector<InputFile>& files) {
  Files names;
  for (const InputFile& file : files)
    if (file.hash != 0) names[file.name].insert(file.hash);
  return names;
}

bool is_lua(const std::string& name) {
  return name == "scene" || name == "language" || name.starts_with("module ");
}

std::string with_path(const std::string& name, const std::vector<InputFile>& files) {
  const auto file = std::ranges::find_if(
      files, [&](const InputFile& each) { return each.name == name && each.hash != 0; });
  return name + (file == files.end() ? " (no longer read)" : " (" + file->path + ")");
}

}  // namespace

Provenance provenance_of(const SceneSpec& scene, const Registry& registry, std::uint64_t seed,
                         std::string program) {
  Provenance made{std::move(program), scene.inputs, {{"--seed", std::to_string(seed)}}, {}};
  for (const InputFile& library : registry.inputs()) made.files.push_back(library);
  for (const SceneArg& arg : scene.args) made.arguments[arg.name] = to_text(arg.value);
  return made;
}

std::vector<std::string> changes(const Provenance& before, const Provenance& now) {
  std::vector<std::string> found;
  const Files then = by_name(before.files), today = by_name(now.files);
  Files all = then;
  all.insert(today.begin(), today.end());
  for (const auto& [name, contents] : all) {
    const auto a = then.find(name), b = today.find(name);
    const bool both = a != then.end() && b != today.end();
    if (both ? a->second != b->second : is_lua(name)) found.push_back(with_path(name, now.files));
  }
  std::map<std::string, std::string> arguments = before.arguments;
  arguments.insert(now.arguments.begin(), now.arguments.end());
  const auto text = [](const auto& values, const std::string& name) {
    const auto value = values.find(name);
    return value == values.end() ? std::string("none") : value->second;
  };
  for (const auto& [name, value] : arguments)
    if (text(before.arguments, name) != text(now.arguments, name))
      found.push_back("argument " + name + ": " + text(before.arguments, name) + ", now " +
                      text(now.arguments, name));
  if (before.program != now.program)
    found.push_back("the program: " + before.program + ", now " + now.program);
  return found;
}

}  // namespace sim
