// The command line of `sim`, checked and turned into requests.
#pragma once

#include <string>
#include <variant>

#include "cli/run/run.h"
#include "cli/verbs/adjacency.h"
#include "cli/verbs/compare.h"
#include "cli/verbs/describe.h"
#include "cli/verbs/doctor.h"
#include "cli/verbs/import_scene.h"
#include "cli/verbs/list.h"
#include "cli/verbs/new_plugin.h"
#include "cli/verbs/new_scene.h"
#include "cli/verbs/order.h"
#include "cli/verbs/plot_table.h"
#include "cli/verbs/rest.h"
#include "cli/verbs/stability.h"
#include "cli/verbs/study.h"
#include "cli/verbs/sweep.h"
#include "cli/verbs/test_plugin.h"
#include "cli/verbs/tradeoff.h"
#include "cli/view/view.h"

namespace sim::cli {

// --help and --version: a text for standard output, and nothing else to do.
struct Message {
  std::string text;
};

struct CommandLine {
  std::variant<Message, RunRequest, AdjacencyRequest, ViewRequest, ListRequest, DescribeRequest,
               DoctorRequest, StabilityRequest, OrderRequest, TradeoffRequest, StudyRequest,
               CompareRequest, SweepRequest, PlotRequest, TestRequest, NewPluginRequest,
               NewSceneRequest, RestRequest, ImportRequest>
      request;
  Folders plugin_path;  // --plugin-path
  Folders libraries;    // --load
  bool probe = false;   // --probe
};

// Studies of plugins. The plugins that the line may mean are opened; only the names of the others
// are known.
struct KnownStudies {
  std::vector<const Plugin<Study>*> opened;
  std::vector<std::string> names;
};

// Throws Error{kUsage} for all errors that can be found before any file is read, and Error{kPlugin}
// for a study that cannot be a verb.
CommandLine parse_command_line(int argc, const char* const* argv, const KnownStudies& studies);

}  // namespace sim::cli
