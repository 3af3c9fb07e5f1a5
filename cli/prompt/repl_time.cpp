// Commands that move in time.
#include <cmath>

#include "cli/prompt/repl_actions.h"
#include "cli/terminal/signals.h"
#include "cli/verbs/rest.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/report/rest_report.h"

namespace sim::cli::actions {
namespace {

// The verdict on a run that a command asked for; a function of Lua gives none.
Answer judged(Call& call, const LiveScene::Outcome& outcome) {
  if (!call.spoken || !outcome) return {};
  const std::optional<double>& cut = call.session.live().judged()->cut;
  const std::string& anew = call.session.live().judged()->anew;
  std::string note = cut ? "sim: note: the last step took " + brief(*cut, 4) + " s" : "";
  if (!anew.empty()) note += "; " + anew + " keeps earlier steps, and begins anew there";
  put(call.session.console().err,
      note + (cut ? "\n" : "") + study::trust_name(outcome->trust) + ": " + outcome->reason + "\n");
  return {};
}

std::string at(std::int64_t step, double t) {
  return "step " + std::to_string(step) + ", t = " + brief(t) + " s";
}

}  // namespace

Answer step(Call& call) {
  call.take(0, 1);
  call.session.live().step(call.count() ? call.integer(0, 0, "a number of steps") : 1);
  return {};
}

Answer run(Call& call) {
  call.take(0, 1);
  LiveScene& live = call.session.live();
  return judged(
      call, live.run(call.count() ? call.seconds(0, 0, "a time in s") : live.system().duration()));
}

Answer until(Call& call) {
  call.take(1, 1);
  Session& session = call.session;
  DataFunction condition;
  if (const auto* function = std::get_if<DataFunction>(&call[0].value)) {
    condition = *function;
  } else {
    const std::string text = call.text(0, "a Lua expression or a function");
    condition = session.lua().compile(text, session.where(), session.line());
  }
  return judged(call,
                session.live().run_until([&] { return session.lua().call(condition).truth(); }));
}

Answer reset(Call& call) {
  call.take(0, 0);
  call.session.live().reset();
  return {};
}

Answer rest(Call& call) {
  call.take(0, 0);
  study::Rest found;
  call.session.live().edit([&](Simulation& system) {
    found = study::come_to_rest(system, SessionSignals::any);
    if (found.why == "interrupted") SessionSignals::check();
    if (!found.found)
      throw Error(ErrorKind::kUsage, {"no rest was found", system.name(), found.why, found.remedy});
  });
  return words(report::rest_text(found) + "\n", found.force);
}

Answer back(Call& call) {
  call.take(0, 1);
  call.session.live().back(call.count() ? call.integer(0, 0, "a number of steps") : 1);
  return {};
}

Answer go_to(Call& call) {
  call.take(1, 1);
  call.session.live().go_to(call.seconds(0, 0, "a time in s"));
  return {};
}

Answer undo(Call& call) {
  call.take(0, 0);
  if (!call.session.live().undo()) call.wrong("there is no change to take back");
  return {};
}

Answer t(Call& call) {
  call.take(0, 0);
  return {call.session.live().system().t()};
}

Answer taken(Call& call) {
  call.take(0, 0);
  return {std::int64_t{call.session.live().system().step_count()}};
}

Answer branch(Call& call) {
  call.take(0, 1);
  LiveScene& live = call.session.live();
  if (call.count() > 0) {
    live.add_branch(call.text(0, "a name"));
    return {};
  }
  std::vector<Data> list;
  std::string text;
  std::size_t width = 0;
  const auto all = live.branches();
  for (const auto& [name, branch] : all) width = std::max(width, name.size());
  for (const auto& [name, branch] : all) {
    const bool here = name == live.branch();
    text +=
        (here ? "* " : "  ") + left(name, width) + "  " + at(branch.steps.front(), branch.t) + "\n";
    list.emplace_back(std::vector<std::pair<Data, Data>>{
        {"name", name}, {"step", branch.steps.front()}, {"t", branch.t}, {"here", here}});
  }
  return words(text, list);
}

Answer switch_to(Call& call) {
  call.take(1, 1);
  call.session.live().switch_to(call.text(0, "a branch"));
  return {};
}

Answer diff(Call& call) {
  call.take(1, 2);
  LiveScene& live = call.session.live();
  const std::string a = call.text(0, "a branch");
  const std::string b = call.count() > 1 ? call.text(1, "a branch") : live.branch();
  const auto found = live.diff(a, b);
  if (!found) return words("no difference between " + a + " and " + b + "\n");
  const Difference& difference = found->difference;
  const std::string& system = found->system;
  const bool component = difference.item == "component";
  const bool particle = difference.item == "particle" || difference.item == "point";
  const std::string unit = !particle ? "" : difference.quantity[0] == 'v' ? " m/s" : " m";
  std::string text = "first difference at " + at(found->step, found->ta);
  if (found->ta != found->tb) text += " (" + b + ": t = " + brief(found->tb) + " s)";
  if (live.scene().spec.world) text += ", system " + system;
  text += ", " + (particle ? "particle" : difference.item) + " " + std::to_string(difference.id) +
          (component ? "" : ", " + difference.quantity);
  const std::size_t width = std::max(a.size(), b.size());
  text += "\n  " + left(a, width) + "  " + brief(difference.a, 17) + unit + "\n  " +
          left(b, width) + "  " + brief(difference.b, 17) + unit + "\n  " +
          std::to_string(difference.ulps()) + " ulp, " + brief(difference.absolute(), 3) + unit +
          ", relative " + brief(difference.relative(), 3) + "\n";
  std::vector<std::pair<Data, Data>> fields;
  if (live.scene().spec.world) fields.emplace_back("system", system);
  fields.insert(fields.end(), {{"step", found->step},
                               {"t", found->ta},
                               {particle ? "particle" : difference.item, difference.id},
                               {"quantity", difference.quantity},
                               {"a", difference.a},
                               {"b", difference.b},
                               {"ulp", static_cast<double>(difference.ulps())},
                               {"relative", difference.relative()}});
  return words(text, fields);
}

}  // namespace sim::cli::actions
