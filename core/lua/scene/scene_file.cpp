#include "core/lua/scene/scene_file.h"

#include <algorithm>
#include <set>

#include "core/base/text.h"
#include "core/lua/scene/scene_reader.h"

namespace sim {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code failed;
  return fs::exists(path, failed) && !fs::is_directory(path, failed);
}

}  // namespace

fs::path find_scene(const std::string& name, const std::vector<fs::path>& search_path) {
  const bool has_ending = name.ends_with(".lua");
  std::vector<fs::path> candidates{name};
  if (!has_ending) candidates.emplace_back(name + ".lua");
  if (!fs::path(name).is_absolute())
    for (const fs::path& folder : search_path)
      for (const fs::path& base : {folder, folder / "scenes"}) {
        candidates.push_back(base / name);
        if (!has_ending) candidates.push_back(base / (name + ".lua"));
      }
  if (!name.empty() && name.size() < 4096 && name.find('\0') == std::string::npos)
    for (const fs::path& candidate : candidates)
      if (is_file(candidate)) return candidate;

  std::string looked = "no such file as given";
  for (const fs::path& folder : search_path) looked += ", in " + folder.string();
  const std::vector<std::string> scenes = list_scenes(search_path);
  std::vector<std::string> known = scenes;  // "clot" is near "cloth", not "scenes/cloth.lua"
  for (const std::string& scene : scenes) known.push_back(fs::path(scene).stem().string());
  const std::string near = nearest(name, known);
  throw Error(ErrorKind::kIo,
              {"scene '" + one_line_text(name) + "' not found", "", looked,
               near.empty() ? suggestion(name, scenes) : "did you mean '" + near + "'?"});
}

std::vector<std::string> list_scenes(const std::vector<fs::path>& search_path) {
  std::set<std::string> names;
  for (const fs::path& folder : search_path) {
    std::error_code failed;
    const auto options = fs::directory_options::skip_permission_denied;
    fs::recursive_directory_iterator entry(folder / "scenes", options, failed), end;
    for (; !failed && entry != end; entry.increment(failed)) {
      std::error_code no_file;
      if (entry->path().extension() == ".lua" && entry->is_regular_file(no_file))
        names.insert(entry->path().lexically_relative(folder).generic_string());
    }
  }
  return {names.begin(), names.end()};
}

SceneSpec load_scene(const std::string& name, Registry& registry, const SceneOptions& options) {
  const fs::path file = options.text ? fs::path(name) : find_scene(name, options.search_path);
  const auto session = std::make_shared<SceneSession>(file, options, registry);
  SceneSpec spec;
  session->lua().protect(file.string(), [&](lua_State* L) {
    session->run(L);
    session->check_settings();
    const LuaBudget::Aside reading(session->lua().budget());
    spec = SceneReader(session, registry).read(L);
  });
  return spec;
}

}  // namespace sim
