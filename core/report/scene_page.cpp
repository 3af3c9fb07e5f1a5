#include "core/report/scene_page.h"

#include <algorithm>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/md5.h"
#include "core/output/format.h"
#include "core/output/output.h"
#include "core/output/page/markup.h"
#include "core/output/page/page.h"
#include "core/output/read_file.h"

namespace sim::report {
namespace {

namespace fs = std::filesystem;

constexpr double kMostScene = 16e6, kMostPage = 64e6;  // bytes

bool is_below(const fs::path& file, const fs::path& folder) {
  const fs::path path = fs::weakly_canonical(file).lexically_relative(fs::weakly_canonical(folder));
  return !path.empty() && *path.begin() != "..";
}

// The folder that a page finds the scene in, as the scene was named; "" where it is not below.
std::string folder_in_page(const std::string& scene, const fs::path& file,
                           const std::vector<fs::path>& folders) {
  for (const fs::path& folder : folders)
    if (is_below(file, folder)) return fs::path(scene).parent_path().generic_string() + "/";
  return "";
}

struct PageFiles {
  std::string scene;  // its name in the page
  JsonObject texts;   // by name
};

// The scene and the modules beside it; the modules of sim are in the page already.
PageFiles files_of(const PageTask& task) {
  PageFiles files;
  const fs::path own = fs::absolute(task.spec->file);
  const std::string folder = folder_in_page(task.scene->scene, own, task.folders);
  const auto add = [&](const std::string& name, const fs::path& file) {
    files.texts.text(name, read_input_file(file.string(), kMostScene, "a page holds less"));
  };
  files.scene = folder + own.filename().string();
  add(files.scene, own);
  for (const InputFile& input : task.spec->inputs) {
    const auto has = [&](const fs::path& place) { return is_below(input.path, place); };
    if (input.hash == 0 || input.name == "scene") continue;
    if (std::ranges::any_of(task.folders, has)) continue;
    if (!has(own.parent_path()))
      throw Error(ErrorKind::kUsage,
                  {"a page cannot hold it", input.path,
                   input.name + " is not in the folder of the scene", "move it there"});
    add(fs::path(input.path)
            .lexically_relative(fs::weakly_canonical(own).parent_path())
            .generic_string(),
        input.path);
  }
  return files;
}

// The request's words about the scene, as lines of a recording's header.
std::string header_of(const NamedScene& scene) {
  std::string lines;
  for (const auto& [word, value] : recording_header(scene))
    if (word != "scene") lines += word + ' ' + value + '\n';
  return lines;
}

}  // namespace

std::size_t write_scene_page(const PageTask& task, FilePlan plan) {
  const std::string source = task.page.string();
  if (!fs::exists(source))
    throw Error(ErrorKind::kIo, {"no kernel for pages", source, "it is not built",
                                 "say ./dev web in the source tree, then install again"});
  const PageFiles files = files_of(task);
  plan.writes("the page", task.file);
  plan.check();
  const std::string words = script_json(JsonObject()
                                            .text("scene", files.scene)
                                            .text("header", header_of(*task.scene))
                                            .json("files", files.texts.str())
                                            .str());
  const std::string nonce = md5(words);
  Output output(task.file);
  output.buffer() =
      fill_placeholders(read_input_file(source, kMostPage, "build it again"),
                        {{"TITLE", markup_text(files.scene)}, {"NONCE", nonce}, {"SCENE", words}});
  const std::size_t bytes = output.buffer().size();
  output.commit();
  return bytes;
}

}  // namespace sim::report
