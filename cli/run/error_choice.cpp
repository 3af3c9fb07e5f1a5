#include "cli/run/error_choice.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "cli/run/study_progress.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/goal_report.h"
#include "core/study/accuracy/required_error.h"

namespace sim::cli {
namespace {

constexpr const char* kToleranceNames[] = {"tol", "rtol", "atol"};

using study::GoalCandidate;
using study::GoalChoice;

std::string goal_amount(const GoalChoice& choice, double value, int digits) {
  return brief(value, digits) + (choice.unit.empty() ? "" : " " + choice.unit);
}

std::string judged_text_of(const RunRequest& request, const GoalChoice& choice) {
  if (!request.of.empty()) return "of " + request.of.front();
  return std::string("rms of ") + (choice.unit.empty() ? "numbers" : "positions") +
         ", at all times";
}

std::string goal_step_text(const GoalChoice& choice) {
  return choice.tolerance > 0 ? "tol " + brief(choice.tolerance, 3) : brief(choice.dt, 4) + " s";
}

// "pefrl 1.4, rk4 2.1": the costs of others, relative to the cheapest.
std::string others_text(const GoalChoice& choice) {
  constexpr std::size_t kMost = 3;
  const double least = choice.candidates.front().cost;
  std::string text;
  std::size_t told = 0;
  for (const GoalCandidate& each : choice.candidates) {
    if (each.label == choice.method->label || !std::isfinite(each.cost) || told == kMost) continue;
    text += (told++ ? ", " : "") + each.label + " " + brief(each.cost / least, 2);
  }
  return text;
}

// The quantity that the error refers to; empty: positions.
std::string quantity_of(const RunRequest& request) {
  return request.of.empty() ? "" : request.of.front();
}

std::string horizon_text(const GoalChoice& choice) {
  if (!std::isnan(choice.missed_at))
    return "not known beyond t = " + brief(choice.missed_at, 4) +
           " s: no step has seen a pulse of a force there";
  return "kept until t = " + brief(choice.horizon, 3) + " s" +
         (choice.chaotic ? "; beyond it neighbouring motions part, and no step helps" : "");
}

}  // namespace

void check_error_request(const RunRequest& request) {
  const auto refuse = [](const char* what, const char* why, const char* remedy) {
    throw Error(ErrorKind::kUsage,
                {"not with --error", std::string(what), std::string(why), std::string(remedy)});
  };
  if (!request.error) {
    if (request.until_horizon)
      refuse("--until-horizon", "it ends a run where the error that was asked for is not kept",
             "add --error E");
    return;
  }
  constexpr const char* kOne = "leave one of the two out";
  if (request.resume)
    refuse("--resume", "the first part of the run has its method and its step already",
           "go on with those, or begin anew with --error");
  if (request.replay) refuse("--replay", "a recording has its method and its steps", kOne);
  if (request.from_rest) refuse("--from-rest", "trials begin with the state of the scene", kOne);
  if (request.engine) refuse("--engine", "another program chooses its own steps", kOne);
  if (!request.export_to.empty() || request.export_file)
    refuse("sim export", "nothing is run", kOne);
  if (request.steps)
    refuse("--steps", "how long a step is is not known before it is chosen", "give --time instead");
  for (const char* name : kToleranceNames)
    if (request.scene.integrator.given.contains(name))
      refuse("--tol", "the tolerance is what is chosen", kOne);
  if (request.of.size() > 1)
    refuse("--of more than once", "the error is that of one quantity", "keep one of them");
}

namespace {

// The error required of a system: by the command line, or by the scene or its method if nothing
// else prescribes steps.
std::optional<study::RequiredError> asked_of(const SystemSpec& spec, const RunRequest& request,
                                             Registry& registry) {
  if (request.error) return study::RequiredError{*request.error};
  const bool steps = request.resume || request.replay || request.from_rest || request.engine ||
                     request.steps || !request.export_to.empty() || request.export_file;
  if (steps || request.of.size() > 1) return {};
  std::optional<study::RequiredError> required =
      study::required_error(spec, request.scene.integrator, request.scene.dt, registry);
  const bool runs = request.time.value_or(spec.duration) > 0;
  if (required && !required->asked && !runs) required.reset();
  return required;
}

study::GoalChoice choose_one(const SystemSpec& spec, const study::RequiredError& required,
                             const RunRequest& request, Registry& registry,
                             const study::Watch& watch) {
  study::ErrorGoal goal{.budget = required.budget,
                        .time = request.time.value_or(spec.duration),
                        .dt = request.scene.dt,
                        .asked = required.asked};
  if (!(goal.time > 0))
    throw Error(ErrorKind::kUsage,
                {"nothing to run", "--error", "the run has no length", "give --time"});
  if (!request.scene.integrator.name.empty())
    goal.integrators = study_choices({request.scene.integrator}, registry);
  study::Problem problem{&spec, &registry, run_options(request.scene, spec, registry)};
  problem.options.dt = 0;
  if (!request.of.empty()) problem.of = quantity(spec, request.of.front());
  return study::choose_for_error(problem, goal, watch);
}

}  // namespace

GoalChoices choose_for_error(RunRequest& request, LoadedScene& scene, Registry& registry,
                             Console& console, int& caught) {
  if (std::ranges::none_of(scene.spec.systems, [&](const SystemSpec& spec) {
        return asked_of(spec, request, registry).has_value();
      }))
    return GoalChoices(scene.systems.size());
  StudyProgress progress(request.progress, console);
  std::ostringstream notes;
  GoalChoices choices = choose_for_error(request, scene, registry, progress.watch(), notes);
  progress.clear();
  console.err << notes.str();
  caught = progress.caught();
  return choices;
}

GoalChoices choose_for_error(RunRequest& request, LoadedScene& scene, Registry& registry,
                             const study::Watch& watch, std::ostream& notes) {
  GoalChoices choices(scene.systems.size());
  const std::optional<double> time = request.time;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const SystemSpec& spec = scene.spec.systems[i];
    const std::optional<study::RequiredError> required = asked_of(spec, request, registry);
    if (!required) continue;
    RunRequest own = request;
    own.time = time;
    choices[i] = choose_one(spec, *required, own, registry, watch);
    const study::GoalChoice& choice = *choices[i];
    if (!choice.complete) return {};
    if (!choice.method && !choice.asked) {
      choices[i].reset();
      const MethodChoice method = request.scene.integrator.over(spec.integrator);
      notes << "sim: note: no error of a method is known by trials that are short beside the "
               "run: '"
            << method.name << "' chooses as it goes\n";
      continue;
    }
    if (!choice.method)
      throw Error(
          ErrorKind::kDiverged,
          {"no step found", spec.name + ", --error",
           "no trial that is short beside the run told an error, and the scene's own steps fail",
           "name a method with -i, or see what '" + command_for(request.scene) +
               "' says without it"});
    RunOptions options = run_options(request.scene, spec, registry);
    options.integrator = choice.integrator();
    options.dt = choice.dt;
    scene.systems[i] = Simulation(spec, registry, options);
    if (!request.until_horizon || choice.kept) continue;
    if (!(choice.horizon > 0))
      throw Error(ErrorKind::kCheck,
                  {"check failed", spec.name + ", error",
                   "it is not kept for any time that was looked at", "allow a larger one"});
    request.time = std::min(request.time.value_or(spec.duration), choice.horizon);
  }
  return choices;
}

std::string error_choice_text(const std::optional<GoalChoice>& made, const RunRequest& request) {
  if (!made) return {};
  const GoalChoice& choice = *made;
  const std::string asked = "at most " + goal_amount(choice, choice.allowed, 3) + " (" +
                            percent(choice.allowed / choice.size, 1, 2) + " of the " +
                            (!request.of.empty()   ? "range"
                             : choice.unit.empty() ? "first state"
                                                   : "size") +
                            "), " + judged_text_of(request, choice);
  std::string text = label("error", wrapped(asked, 12, 12));
  const std::string others = others_text(choice);
  const bool restricted = !request.scene.integrator.name.empty() || request.scene.dt > 0;
  const std::string why =
      choice.from_scene
          ? "the scene's own method; trials that are short beside the run tell too little"
      : !choice.kept ? "the closest of " +
                           counted(static_cast<long>(choice.candidates.size()), "method") + " tried"
      : restricted && choice.candidates.size() == 1
          ? "as asked for"
          : "the cheapest of " + counted(static_cast<long>(choice.candidates.size()), "method") +
                " tried" + (others.empty() ? "" : "; over its cost: " + others);
  text += label("chosen",
                wrapped(choice.method->label + ", " + goal_step_text(choice) + ": " + why, 12, 12));
  std::string measured = goal_amount(choice, choice.error, 2) + " from " +
                         (choice.tolerance > 0 ? "a tenth of the tolerance" : "half the step") +
                         " over the whole run";
  if (request.of.empty() && !choice.unit.empty())
    measured += ", of a particle at most " + goal_amount(choice, choice.largest, 2);
  if (!choice.kept) measured += "; " + horizon_text(choice);
  text += label("measured", wrapped(measured, 12, 12));
  std::string cost = brief(choice.cost, 3) + " evaluations";
  if (const double over = report::over_cheapest(choice); std::isfinite(over))
    cost += ", " + brief(over, 2) + " times the cheapest known";
  if (choice.kept && std::isfinite(choice.cost_of_ten))
    cost += "; ten times the error would cost " +
            brief(std::min(1.0, choice.cost_of_ten / choice.cost), 2) + " times that";
  cost += "; trials took " + brief(choice.trials / choice.cost, 2) + " times that, its check " +
          brief(choice.check / choice.cost, 2);
  if (choice.mended > 0)
    cost += ", " + counted(choice.mended, "run") + " that missed among the trials";
  return text + label("cost", wrapped(cost, 12, 12));
}

std::string error_choice_json(const std::optional<GoalChoice>& made, const RunRequest& request) {
  if (!made) return {};
  return report::goal_json(*made, quantity_of(request),
                           command_for(request.scene) + report::goal_options(*made, request.time));
}

study::RunDeviation parting_of(const std::optional<GoalChoice>& made, const RunRequest& request) {
  return made ? report::goal_deviation(*made, quantity_of(request)) : study::RunDeviation();
}

void check_error_kept(const std::optional<GoalChoice>& made, const RunRequest& request) {
  if (!made) return;
  const GoalChoice& choice = *made;
  const bool missed_pulse = !std::isnan(choice.missed_at);
  if (choice.kept || !choice.asked || (request.until_horizon && !missed_pulse)) return;
  throw Error(ErrorKind::kCheck,
              {"check failed", choice.system + ", error",
               goal_amount(choice, choice.allowed, 3) + " is " + horizon_text(choice),
               missed_pulse     ? "add -i verlet -d with a step below the length of the pulse"
               : choice.chaotic ? "add --until-horizon, or judge a quantity with --of"
                                : "allow a larger error, or add --until-horizon"});
}

}  // namespace sim::cli
