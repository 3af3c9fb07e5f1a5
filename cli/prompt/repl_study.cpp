// The accuracy of a session: the verdict, the limit of the step, and the studies.
#include <cmath>

#include "cli/command_line/option_values.h"
#include "cli/prompt/repl_actions.h"
#include "cli/run/error_choice.h"
#include "cli/verbs/order.h"
#include "cli/verbs/stability.h"
#include "cli/verbs/study.h"
#include "cli/verbs/tradeoff.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/study/limits/step_limit.h"

namespace sim::cli {

std::string limit_warning(Simulation& system) {
  const Integrator& integrator = system.integrator();
  if (system.integrator_info().adaptive || std::isnan(integrator.amplification(0.1, 0))) return "";
  constexpr int kProducts = 40;
  const study::StepShare share =
      study::step_share(integrator, study::limiting_vibration(system, kProducts), system.h());
  if (!(share.share > 1)) return "";
  const std::string name = system.method().name();
  if (std::isinf(share.share))
    return "sim: warning: " + name + " has no stable step near this one\n";
  return "sim: warning: dt is " + brief(100 * share.share, 3) +
         " % of the largest stable one, about " + brief(system.h() / share.share, 2) + " s for " +
         name + "\n";
}

namespace actions {
namespace {

ShowProgress progress_of(const Session& session) {
  return session.interactive() ? ShowProgress::kAuto : ShowProgress::kOff;
}

// A study runs the scene from its file, with its parameters as they are now, and here with the
// integrator and step of the session.
SceneRequest scene_of(Session& session) {
  LiveScene& live = session.live();
  SceneRequest request = live.request();
  if (live.scene().spec.world) return request;
  const MethodChoice& method = live.system().method().choice();
  request.integrator.name = method.name;
  request.integrator.given.clear();
  for (const auto& [name, value] : method.given) request.integrator.given[name] = to_text(value);
  request.dt = live.system().h();
  return request;
}

// "1%" or "1e-3 m", which may be two words; "" if it is not given.
std::string allowed(Call& call, const std::string& command) {
  call.take(0, 2);
  std::string text;
  for (std::size_t i = 0; i < call.count(); ++i)
    text += (i > 0 ? " " : "") + call.text(i, "an error allowed, as 1% or 1e-3 m");
  if (!text.empty()) study::parse_budget(command, text);
  return text;
}

}  // namespace

Answer verdict(Call& call) {
  call.take(0, 0);
  const auto& judged = call.session.live().judged();
  if (!judged) return words("there was no run yet: .run makes one\n");
  const std::string trust = study::trust_name(judged->verdict.trust);
  const std::string text = trust + ": " + judged->verdict.reason + "\n";
  return words(
      text + "of the run from t = " + brief(judged->from) + " s to " + brief(judged->to) + " s\n",
      std::vector<std::pair<Data, Data>>{{"verdict", trust},
                                         {"reason", judged->verdict.reason},
                                         {"from", judged->from},
                                         {"to", judged->to}});
}

Answer stability(Call& call) {
  call.take(0, 1);
  Session& session = call.session;
  StabilityRequest request;
  request.scene = scene_of(session);
  if (call.count() > 0)
    request.integrators = parse_integrators(".stability", call.text(0, "integrators"));
  request.json = session.mode == Mode::kJson;
  request.progress = progress_of(session);
  cli::stability(request, session.environment(), session.registry(), session.console());
  return {};
}

Answer tradeoff(Call& call) {
  Session& session = call.session;
  TradeoffRequest request;
  request.scene = session.live().request();
  if (const std::string text = allowed(call, ".tradeoff"); !text.empty())
    request.budget = study::parse_budget(".tradeoff", text);
  request.json = session.mode == Mode::kJson;
  request.progress = progress_of(session);
  cli::tradeoff(request, session.environment(), session.registry(), session.console());
  return {};
}

// The scene is tried as its file makes it; the integrator and the step chosen hold from now on.
Answer error(Call& call) {
  Session& session = call.session;
  LiveScene& live = session.live();
  const std::string text = allowed(call, ".error");
  if (text.empty())
    throw Error(ErrorKind::kUsage, {"no error asked for", ".error", "it says what may be off",
                                    "write .error 1% or .error 1mm"});
  if (live.scene().spec.world)
    throw Error(ErrorKind::kUsage,
                {"not in a world", ".error", "its systems need steps of their own",
                 "leave the prompt and run sim SCENE --error " + text});
  RunRequest request;
  request.scene = live.request();
  request.scene.integrator = {};
  request.scene.dt = 0;
  request.error = study::parse_budget(".error", text);
  request.progress = progress_of(session);
  LoadedScene scene = load(request.scene, session.environment(), session.registry());
  int caught = 0;
  const GoalChoices choices =
      choose_for_error(request, scene, session.registry(), session.console(), caught);
  if (caught != 0) return words("interrupted: integrator and dt are as they were\n");
  const study::GoalChoice& choice = *choices.front();
  live.set_integrator(choice.integrator());
  live.set_dt(choice.dt);
  return words(error_choice_text(choice, request),
               std::vector<std::pair<Data, Data>>{{"integrator", choice.method->label},
                                                  {"dt", choice.dt},
                                                  {"tol", choice.tolerance},
                                                  {"error", choice.error},
                                                  {"kept", choice.kept},
                                                  {"cost", choice.cost}});
}

Answer minimal(Call& call) {
  Session& session = call.session;
  StudyRequest request;
  request.study = "minimal";
  request.scene = scene_of(session);
  if (const std::string text = allowed(call, ".minimal"); !text.empty())
    request.given["budget"] = text;
  request.json = session.mode == Mode::kJson;
  request.progress = progress_of(session);
  cli::study(request, session.environment(), session.registry(), session.console());
  return {};
}

Answer order(Call& call) {
  call.take(0, 1);
  Session& session = call.session;
  OrderRequest request;
  request.scene = session.live().request();
  if (call.count() > 0) request.words.push_back(call.text(0, "an integrator"));
  request.words.push_back(request.scene.scene);
  request.json = session.mode == Mode::kJson;
  request.progress = progress_of(session);
  cli::order(request, session.environment(), session.registry(), session.console());
  return {};
}

}  // namespace actions
}  // namespace sim::cli
