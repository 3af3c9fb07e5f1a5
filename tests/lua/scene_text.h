// Scenes written as text by a test, in a folder of their own.
#pragma once

#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/lua/scene/scene_file.h"
#include "core/scene/simulation.h"

namespace sim::test {

class SceneFolder {
 public:
  SceneFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "sim_lua_XXXXXX").string();
    REQUIRE(mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  ~SceneFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  SceneFolder(const SceneFolder&) = delete;
  SceneFolder& operator=(const SceneFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

  std::string write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file.string();
  }

 private:
  std::filesystem::path path_;
};

using Settings = std::map<std::string, std::string>;

inline std::vector<std::filesystem::path> search_path() {
  return {std::filesystem::path(SIM_SOURCE_DIR) / "scripts"};
}

// A scene of which every system can be compiled.
inline SceneSpec load(const std::string& file, const Settings& settings = {},
                      std::uint64_t seed = 0) {
  Registry registry({SIM_PLUGIN_DIR});
  SceneSpec spec = load_scene(file, registry, {search_path(), settings, seed});
  for (const SystemSpec& system : spec.systems) Simulation(system, registry);
  return spec;
}

// The scene of a text that starts with the usual line; its own first line is line 2.
inline SceneSpec load_text(const std::string& text, const Settings& settings = {},
                           std::uint64_t seed = 0) {
  const SceneFolder folder;
  return load(folder.write("scene.lua", "local sim = require \"sim\"\n" + text), settings, seed);
}

// The error of loading a file, with the folder cut from its place: "scene.lua:3".
inline std::optional<Error> load_error(const SceneFolder& folder, const std::string& file,
                                       const Settings& settings = {}) {
  try {
    load(file, settings);
  } catch (const Error& error) {
    ErrorText text = error.text();
    const std::string prefix = folder.path().string() + "/";
    if (text.where.starts_with(prefix)) text.where.erase(0, prefix.size());
    return Error(error.kind(), text);
  }
  return {};
}

inline std::optional<Error> text_error(const std::string& text, const Settings& settings = {}) {
  const SceneFolder folder;
  return load_error(folder, folder.write("scene.lua", "local sim = require \"sim\"\n" + text),
                    settings);
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// The refusal of a scene of this text, as users read it after its location.
inline std::string said(const std::string& text) {
  const auto error = text_error(text);
  REQUIRE(error);
  CHECK(contains(error->text().where, "scene.lua:"));
  return error->text().what + ": " + error->text().why + "; " + error->text().remedy;
}

// A scene of this text that runs.
struct TextRun {
  TextRun(const std::string& text, const std::string& method, double dt, int threads = 1)
      : spec(load_text(text)),
        system(spec.systems[0], registry,
               {.integrator = method == "dopri5" ? MethodChoice{method, {{"tol", 1e-12}}}
                                                 : MethodChoice{method},
                .dt = dt,
                .threads = threads}) {}
  void run_to(double t) {
    while (system.t() < t - 1e-9) REQUIRE(system.step());
  }

  Registry registry{{SIM_PLUGIN_DIR}};
  SceneSpec spec;
  Simulation system;
};

// The rest of a scene whose first lines made `particles` and `forces`.
inline const std::string kEnd =
    "return sim.scene { particles = particles, forces = forces, integrator = \"rk4\", dt = 0.01, "
    "duration = 1 }\n";

}  // namespace sim::test
