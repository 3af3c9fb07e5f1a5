// sim view: its options.
#pragma once

#include <string>
#include <vector>

#include "cli/view/view.h"

namespace CLI {
class App;
}  // namespace CLI

namespace sim::cli {

// The texts of the options, as the command line has them.
struct ViewTexts {
  std::string scene, port, record;
  bool no_open = false, window = false, terminal = false, pause_hidden = false;
};

CLI::App* add_view_options(CLI::App& app, ViewTexts& texts);

// Methods: as they were given, one or several. Throws Error{kUsage}.
ViewRequest view_request(const ViewTexts& texts, SceneRequest scene,
                         const std::vector<std::string>& methods);

}  // namespace sim::cli
