// A page with the kernel, a scene and an editor in one file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "core/output/file_plan.h"
#include "core/report/replays.h"

namespace sim::report {

struct PageTask {
  const NamedScene* scene;
  const SceneSpec* spec;                       // as it was read
  std::vector<std::filesystem::path> folders;  // whose modules the page has
  std::filesystem::path page;                  // that ./dev web made
  std::string file;
};

// Writes task.file, and returns how many bytes it has; `plan` has what was read. Throws Error{kIo}
// where there is no page, and Error{kUsage} for a scene of files that a page cannot hold.
std::size_t write_scene_page(const PageTask& task, FilePlan plan);

}  // namespace sim::report
