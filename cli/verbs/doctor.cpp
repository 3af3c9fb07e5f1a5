#include "cli/verbs/doctor.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "cli/run/scene.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/engine/engine.h"
#include "core/engine/engine_run.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/format.h"
#include "core/output/process.h"

namespace sim::cli {
namespace {

// A single finding.
struct Check {
  std::string name, found;
  bool good = true;
  bool absent = false;  // a part that a run may do without
};

class Examination {
 public:
  explicit Examination(const Environment& environment) : environment_(environment) {}

  void build();
  void folders(const std::string& name, const Folders& list);
  void plugins(const Folders& libraries);
  void scenes();
  void optional_parts();

  const std::vector<Check>& checks() const { return checks_; }

 private:
  void plugins_of(const PluginKind& kind);

  const Environment& environment_;
  std::unique_ptr<Registry> registry_;
  std::vector<Check> checks_;
};

void Examination::build() {
  checks_.push_back({"program", version_line()});
  const unsigned threads = std::thread::hardware_concurrency();
  checks_.push_back({"threads", threads ? counted(threads, "hardware thread") : "unknown"});
}

// Optional parts, and the Debian package of each.
void Examination::optional_parts() {
  const auto part = [&](const std::string& name, const std::string& found, const std::string& use,
                        const std::string& package) {
    checks_.push_back({name, found.empty() ? use + "; " + package : found, true, found.empty()});
  };
  const auto built = [&](const PluginKind& kind, const std::string& name) -> std::string {
    return registry_ && registry_->find(kind, name) ? "in this build" : "";
  };
  part("HDF5", built(kind_of<Writer>, "h5"), "files .h5", "install libhdf5-dev and build again");
  part("page", built(kind_of<View>, "web"), "sim view", "install libboost-dev and build again");
  part("window", built(kind_of<View>, "window"), "sim view --window",
       "install libglfw3-dev, libepoxy-dev and libimgui-dev and build again");
  part("ffmpeg", find_program("ffmpeg"), "films", "install ffmpeg");
  if (registry_)
    for (const std::string& name : registry_->names<engine::Engine>()) {
      try {
        const auto engine = engine::make_engine(name, *registry_);
        part(name, join(engine->programs(), ", "), "--engine " + name, "needs " + engine->needs());
      } catch (const Error&) {
        continue;  // told among the plugins
      }
    }
  part("MPI", find_program("mpirun"), "--ranks", "install openmpi-bin");
}

void Examination::folders(const std::string& name, const Folders& list) {
  if (list.empty()) checks_.push_back({name, "no such folder", false});
  for (const std::filesystem::path& folder : list) {
    std::error_code error;
    const bool good = std::filesystem::is_directory(folder, error);
    checks_.push_back({name, folder.string() + (good ? "" : " cannot be read"), good});
  }
}

void Examination::plugins(const Folders& libraries) {
  try {
    registry_.reset(new Registry(open_registry(environment_, libraries)));
  } catch (const Error& error) {
    checks_.push_back({"plugins", error.what(), false});
    return;
  }
  for (const PluginKind& kind : kPluginKinds) plugins_of(kind);
  for (const std::string& reason : registry_->rejected())
    checks_.push_back({"rejected", reason, false});
}

void Examination::plugins_of(const PluginKind& kind) {
  const std::string name = std::string(kind.folder);
  std::vector<std::string> good;
  for (const std::string& plugin : registry_->names(kind)) {
    try {
      if (registry_->find(kind, plugin)) good.push_back(plugin);
    } catch (const Error& error) {
      checks_.push_back({name, error.what(), false});
    }
  }
  checks_.push_back({name, good.empty() ? "none" : join(good, ", ")});
}

void Examination::scenes() {
  const std::size_t count = list_scenes(environment_.scene_folders).size();
  checks_.push_back({"scenes", counted(static_cast<long>(count), "scene"), count > 0});
  if (!registry_) return;
  const SceneRequest request;
  try {
    LoadedScene scene = load(request, environment_, *registry_);
    const bool stepped = std::all_of(scene.systems.begin(), scene.systems.end(),
                                     [](Simulation& system) { return system.step(); });
    checks_.push_back(
        {"run", request.scene + (stepped ? " takes a step" : " diverges at once"), stepped});
  } catch (const Error& error) {
    checks_.push_back({"run", error.what(), false});
  }
}

}  // namespace

int doctor(const DoctorRequest& request, const Environment& environment, Console& console) {
  Examination examination(environment);
  examination.build();
  examination.folders("plugin path", environment.plugin_folders);
  examination.folders("scene path", environment.scene_folders);
  examination.plugins(request.libraries);
  examination.scenes();
  examination.optional_parts();

  std::string text;
  std::vector<std::string> objects;
  long bad = 0;
  for (const Check& check : examination.checks()) {
    bad += !check.good;
    text += (check.absent ? "absent "
             : check.good ? "ok     "
                          : "WRONG  ") +
            left(check.name, 13) + check.found + '\n';
    objects.push_back(JsonObject()
                          .text("check", check.name)
                          .flag("ok", check.good)
                          .flag("absent", check.absent)
                          .text("found", check.found)
                          .str());
  }
  text += bad == 0 ? "\nall is well\n" : "\n" + counted(bad, "problem") + " found\n";
  if (request.json)
    text = JsonObject().flag("ok", bad == 0).json("checks", json_array(objects)).str() + "\n";
  put(console.out, text);
  flush_or_throw(console.out, "standard output");
  if (bad == 0) return 0;
  print_error(console.err, "the environment is not sound: " + counted(bad, "problem") +
                               "; see the lines marked WRONG");
  return static_cast<int>(ErrorKind::kIo);
}

}  // namespace sim::cli
