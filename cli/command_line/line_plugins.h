// The plugins of a command line. Studies are verbs: they are looked up before the line is
// understood.
#pragma once

#include <memory>
#include <vector>

#include "cli/run/environment.h"
#include "core/study/study.h"

namespace sim::cli {

class LinePlugins {
 public:
  // It reads only --plugin-path, --load and --probe. No library is opened yet, and folders that
  // cannot be read are no error before registry().
  LinePlugins(int argc, const char* const* argv);

  // The studies that a word may mean, by name or alias; all usable ones for help. Throws
  // Error{kPlugin} if the library of a named one is unusable.
  std::vector<const Plugin<Study>*> studies();
  // Names of all studies, for suggestions.
  std::vector<std::string> names() const;

  // Every plugin, those of --load opened. Throws Error{kIo}, Error{kPlugin}.
  Registry& registry();

 private:
  std::vector<std::string> words_;
  Folders plugin_path_, libraries_;
  bool probe_ = false;
  std::unique_ptr<Registry> registry_;  // null: see registry()
};

}  // namespace sim::cli
