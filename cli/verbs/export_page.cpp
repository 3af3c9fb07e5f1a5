#include "cli/verbs/export_page.h"

#include <algorithm>
#include <filesystem>

#include "cli/run/replay_file.h"
#include "cli/run/run_files.h"
#include "core/base/error.h"
#include "core/base/md5.h"
#include "core/base/read_file.h"
#include "core/output/format.h"
#include "core/output/output.h"
#include "core/output/page/markup.h"
#include "core/output/page/page.h"

namespace sim::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kMostScene = 16e6, kMostPage = 64e6;  // bytes

bool is_below(const fs::path& file, const fs::path& folder) {
  const fs::path path = fs::weakly_canonical(file).lexically_relative(fs::weakly_canonical(folder));
  return !path.empty() && *path.begin() != "..";
}

// The folder that a page finds the scene in, as the scene was named; "" where it is not below.
std::string folder_in_page(const std::string& scene, const fs::path& file,
                           const Environment& environment) {
  for (const fs::path& folder : environment.scene_folders)
    if (is_below(file, folder)) return fs::path(scene).parent_path().generic_string() + "/";
  return "";
}

struct PageFiles {
  std::string scene;  // its name in the page
  JsonObject texts;   // by name
};

// The scene and the modules beside it; the modules of sim are in the page already.
PageFiles files_of(const RunRequest& request, const LoadedScene& scene,
                   const Environment& environment) {
  PageFiles files;
  const fs::path own = fs::absolute(scene.spec.file);
  const std::string folder = folder_in_page(request.scene.scene, own, environment);
  const auto add = [&](const std::string& name, const fs::path& file) {
    files.texts.text(name, read_input_file(file.string(), kMostScene, "a page holds less"));
  };
  files.scene = folder + own.filename().string();
  add(files.scene, own);
  for (const InputFile& input : scene.spec.inputs) {
    const auto has = [&](const fs::path& place) { return is_below(input.path, place); };
    if (input.hash == 0 || input.name == "scene") continue;
    if (std::ranges::any_of(environment.scene_folders, has)) continue;
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
std::string header_of(const RunRequest& request) {
  std::string lines;
  for (const auto& [word, value] : recording_header(request.scene))
    if (word != "scene") lines += word + ' ' + value + '\n';
  return lines;
}

}  // namespace

int export_page(const RunRequest& request, const LoadedScene& scene, const Environment& environment,
                FilePlan plan, Console& console) {
  const std::string source = page_with_kernel().string();
  if (!fs::exists(source))
    throw Error(ErrorKind::kIo, {"no kernel for pages", source, "it is not built",
                                 "say ./dev web in the source tree, then install again"});
  const PageFiles files = files_of(request, scene, environment);
  plan.writes("the page", request.export_to);
  plan.check();
  const std::string words = script_json(JsonObject()
                                            .text("scene", files.scene)
                                            .text("header", header_of(request))
                                            .json("files", files.texts.str())
                                            .str());
  const std::string nonce = md5(words);
  Output output(request.export_to);
  output.buffer() =
      fill_placeholders(read_input_file(source, kMostPage, "build it again"),
                        {{"TITLE", markup_text(files.scene)}, {"NONCE", nonce}, {"SCENE", words}});
  const std::size_t bytes = output.buffer().size();
  output.commit();
  if (request.json)
    put(console.out, JsonObject()
                             .text("file", request.export_to)
                             .integer("bytes", static_cast<std::int64_t>(bytes))
                             .str() +
                         '\n');
  else if (!request.quiet)
    put(console.out, label("wrote", request.export_to) +
                         label("opens", "in any browser, without a server or a network"));
  flush_or_throw(console.out, "standard output");
  return 0;
}

}  // namespace sim::cli
