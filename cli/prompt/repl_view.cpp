// Views of the prompt's scene, in which a user acts; the actions are part of the session.
#include <algorithm>

#include "cli/prompt/repl_actions.h"
#include "cli/terminal/signals.h"
#include "cli/view/view.h"
#include "core/base/error.h"

namespace sim::cli::actions {
namespace {

std::string stepped(std::int64_t steps) {
  return steps == 0 ? ""
                    : (steps > 0 ? ".step " : ".back ") + std::to_string(std::abs(steps)) + "\n";
}

// Commands that lead from step `from` to the end of a recording: forwards only, without discarded
// history.
std::string commands_of(const std::string& recorded, std::int64_t from, std::int64_t to) {
  const Recording recording = parse_recording(recorded, ".view");
  const auto found = recording.systems.find("");
  std::string lines;
  std::int64_t at = from;
  if (found != recording.systems.end())
    for (const RecordedAction& each : found->second.actions) {
      const bool reset = each.action.what == Action::What::kReset;
      lines +=
          reset ? ".reset\n" : stepped(each.step - at) + ".hand " + to_text(each.action) + "\n";
      at = each.step;
    }
  return lines + stepped(to - at);
}

}  // namespace

Answer view(Call& call) {
  call.take(0, 1);
  const std::string where = call.count() == 0 ? "page" : call.text(0, "where it is seen");
  if (where != "page" && where != "terminal" && where != "window")
    call.wrong("expected page, terminal or window, got '" + where + "'");
  Session& session = call.session;
  LiveScene& live = session.live();
  ViewRequest request;
  request.scene = live.request();
  request.terminal = where == "terminal";
  request.window = where == "window";
  std::string recorded;
  const bool world = live.scene().spec.world;
  RecordingWriter own([&](std::string_view lines) { recorded += lines; },
                      {{"scene", live.request().scene}}, world);
  const std::int64_t from = live.system().step_count();
  live.lend([&](std::vector<Timeline>& timelines, RecordingWriter* other) {
    std::vector<RecordingWriter*> writers{&own};
    if (other) writers.push_back(other);
    view_present(live.loaded(), timelines, request, writers, session.environment(),
                 session.registry(), session.console(), [] { return SessionSignals::caught(); });
  });
  const std::int64_t to = live.system().step_count();
  own.end("", to, live.system().hash());
  // In a world systems are stepped together here, and as the first one's clock requires there.
  session.add_to_script(world ? "-- .view: what hands did in a world is not in here\n"
                              : commands_of(recorded, from, to));
  SessionSignals::forget_interrupt();  // it closed the view, and nothing else
  SessionSignals::check();
  return {};
}

}  // namespace sim::cli::actions
