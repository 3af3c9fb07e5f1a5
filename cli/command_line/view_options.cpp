#include "cli/command_line/view_options.h"

#include <CLI/CLI.hpp>

#include "cli/command_line/option_values.h"

namespace sim::cli {

CLI::App* add_view_options(CLI::App& app, ViewTexts& texts) {
  CLI::App* view = app.add_subcommand("view", "SCENE: see it run, pull it, pin it, in the browser");
  view->fallthrough()->allow_extras();
  view->get_formatter()->column_width(26);
  view->add_option("SCENE", texts.scene, "Lua file; scenes/cloth.lua if not given")->type_name("");
  view->add_option("--port", texts.port, "of the page on this machine; a free one if not given")
      ->type_name("N");
  view->add_flag("--no-open", texts.no_open, "print the address, open no browser")
      ->disable_flag_override();
  view->add_flag("--window", texts.window, "in a window on this machine instead")
      ->disable_flag_override();
  view->add_flag("--terminal", texts.terminal, "in this terminal instead, with its mouse")
      ->disable_flag_override();
  view->add_flag("--pause-hidden", texts.pause_hidden,
                 "pause while a page is hidden, as behind a tab")
      ->disable_flag_override();
  view->add_option("--record", texts.record,
                   "what hands do, line by line; sim --replay FILE\nrepeats it with the same bits")
      ->type_name("FILE");
  view->footer(
      "It takes -i (several: side by side, under the same hands), -d, --set, --off,\n"
      "--without, --seed, --threads, --plugin-path and --load, as in sim --help. The\n"
      "page shows its keys when ? is pressed.\n");
  return view;
}

// -i more than once: side by side.
std::vector<MethodChoice> panels(const std::vector<std::string>& methods,
                                 const std::string& record) {
  std::vector<MethodChoice> list;
  for (const std::string& method : methods) list.push_back(parse_integrator(method));
  constexpr std::size_t kMostPanels = 6;
  if (list.size() > kMostPanels)
    usage_error("too many panels", "--integrator", "six fit side by side", "leave some out");
  if (list.size() > 1 && !record.empty())
    usage_error("several systems of one name", "--record",
                "a recording is of a scene, not of a comparison", "give one --integrator");
  return list;
}

ViewRequest view_request(const ViewTexts& texts, SceneRequest scene,
                         const std::vector<std::string>& methods) {
  constexpr std::int64_t kMostPort = 65535;
  ViewRequest request;
  request.scene = std::move(scene);
  if (!texts.port.empty())
    request.port = static_cast<int>(integer_between("--port", texts.port, 1, kMostPort));
  request.open = !texts.no_open;
  if (texts.window && texts.terminal)
    usage_error("two places to look", "--window --terminal", "it is seen in one", "leave out one");
  request.window = texts.window;
  request.terminal = texts.terminal;
  request.pause_hidden = texts.pause_hidden;
  if (!texts.record.empty()) request.record = texts.record;
  request.compare = panels(methods, texts.record);
  if (request.compare.size() == 1) {
    request.scene.integrator = request.compare.front();
    request.compare.clear();
  }
  return request;
}

}  // namespace sim::cli
