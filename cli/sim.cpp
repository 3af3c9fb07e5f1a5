// sim: runs scenes and answers questions about them.
#include "cli/command_line/line_plugins.h"
#include "cli/command_line/options.h"
#include "cli/run/environment.h"
#include "cli/terminal/console.h"

namespace {

using namespace sim::cli;

struct Dispatch {
  const CommandLine& line;
  LinePlugins& plugins;
  Console& console;

  int operator()(const Message& message) const {
    console.out << message.text;
    sim::flush_or_throw(console.out, "standard output");
    return 0;
  }

  int operator()(const DoctorRequest& request) const {
    return doctor(request, find_environment(line.plugin_path), console);
  }

  int operator()(const ImportRequest& request) const { return import_scene(request, console); }

  int operator()(const PlotRequest& request) const { return plot_table(request, console); }

  int operator()(const NewPluginRequest& request) const { return new_plugin(request, console); }

  int operator()(const NewSceneRequest& request) const { return new_scene(request, console); }

  template <class Request>
  int operator()(const Request& request) const {
    const Environment environment = find_environment(line.plugin_path);
    return verb(request, environment, plugins.registry());
  }

  int verb(const RunRequest& request, const Environment& env, sim::Registry& registry) const {
    return run(request, env, registry, console);
  }
  int verb(const AdjacencyRequest& request, const Environment& env, sim::Registry& registry) const {
    return adjacency(request, env, registry, console);
  }
  int verb(const ViewRequest& request, const Environment& env, sim::Registry& registry) const {
    return view(request, env, registry, console);
  }
  int verb(const ListRequest& request, const Environment& env, sim::Registry& registry) const {
    return list(request, env, registry, console);
  }
  int verb(const DescribeRequest& request, const Environment& env, sim::Registry& registry) const {
    return describe(request, env, registry, console);
  }
  int verb(const TestRequest& request, const Environment&, sim::Registry& registry) const {
    return test_plugin(request, registry, console);
  }
  int verb(const StabilityRequest& request, const Environment& env, sim::Registry& registry) const {
    return stability(request, env, registry, console);
  }
  int verb(const OrderRequest& request, const Environment& env, sim::Registry& registry) const {
    return order(request, env, registry, console);
  }
  int verb(const TradeoffRequest& request, const Environment& env, sim::Registry& registry) const {
    return tradeoff(request, env, registry, console);
  }
  int verb(const RestRequest& request, const Environment& env, sim::Registry& registry) const {
    return rest(request, env, registry, console);
  }
  int verb(const StudyRequest& request, const Environment& env, sim::Registry& registry) const {
    return study(request, env, registry, console);
  }
  int verb(const CompareRequest& request, const Environment& env, sim::Registry& registry) const {
    return compare(request, env, registry, console);
  }
  int verb(const SweepRequest& request, const Environment& env, sim::Registry& registry) const {
    return sweep(request, env, registry, console);
  }
};

}  // namespace

int main(int argc, char** argv) {
  Console console = standard_console();
  try {
    LinePlugins plugins(argc, argv);
    const CommandLine line = parse_command_line(argc, argv, {plugins.studies(), plugins.names()});
    return std::visit(Dispatch{line, plugins, console}, line.request);
  } catch (...) {
    return report_exception(console.err);
  }
}
