// Methods and steps that keep an error.
#include "core/c/choice.h"

#include <algorithm>
#include <cmath>

#include "core/c/sim.h"
#include "core/output/format.h"
#include "core/report/goal_report.h"
#include "core/report/study_words.h"
#include "core/study/accuracy/required_error.h"
#include "core/study/budget.h"
#include "core/study/method_text.h"

namespace sim::c {
namespace {

// The error that is asked for, or else that which the system or its method asks for.
std::optional<study::RequiredError> required_of(const sim_scene& scene,
                                                const ChoiceRequest& request,
                                                const SystemSpec& spec) {
  if (request.error) return study::RequiredError{*request.error};
  const SceneVariant& variant = scene.asked.variant;
  return study::required_error(spec, variant.integrator, variant.dt, *scene.registry);
}

std::string command_of(const sim_scene& scene) {
  std::string text = "sim " + scene.loaded.spec.file;
  for (const auto& [name, value] : scene.asked.variant.settings)
    text += " -s " + name + "=" + value;
  return text;
}

}  // namespace

bool asks_for_error(const sim_scene& scene, bool or_method) {
  const auto& systems = scene.loaded.spec.systems;
  return std::ranges::any_of(systems, [&](const SystemSpec& spec) {
    const std::optional<study::RequiredError> required = required_of(scene, {}, spec);
    return required && (required->asked || or_method);
  });
}

void choose(sim_scene& scene, const ChoiceRequest& request, Watcher& watcher) {
  const SceneVariant& variant = scene.asked.variant;
  Registry& registry = *scene.registry;
  std::vector<std::optional<study::GoalChoice>> choices(scene.loaded.systems.size());
  const study::Watch watch = [&](std::string_view what, double done) {
    return !watcher.stopped(std::string(what).c_str(), done);
  };
  const Stop::By asked(*scene.stop, [&] { return watcher.stopped("trials", 0.5); });
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const SystemSpec& spec = scene.loaded.spec.systems[i];
    const std::optional<study::RequiredError> required = required_of(scene, request, spec);
    if (!required) continue;
    const double time = request.time > 0 ? request.time : spec.duration;
    if (!required->asked && !(time > 0)) continue;
    study::ErrorGoal goal{
        .budget = required->budget, .time = time, .dt = variant.dt, .asked = required->asked};
    if (!(goal.time > 0))
      refuse("nothing to run", "time", "the run has no length", "give a time in s");
    if (!variant.integrator.name.empty())
      goal.integrators = {study::typed(variant.integrator, variant.integrator.name, registry)};
    study::Problem problem{&spec, &registry, run_options(variant, scene.asked, spec, registry)};
    problem.options.dt = 0;
    problem.of = report::quantity(spec, request.of);
    choices[i] = study::choose_for_error(problem, goal, watch);
    if (watcher.told()) return;
    if (!choices[i]->method && !required->asked)
      choices[i].reset();
    else if (!choices[i]->method)
      throw Error(
          ErrorKind::kDiverged,
          {"no step found", spec.name + ", error",
           "no trial that is short beside the run told an error, and the scene's own steps fail",
           "name an integrator, or see what a run without it says"});
  }
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (!choices[i]) continue;
    const SystemSpec& spec = scene.loaded.spec.systems[i];
    RunOptions options = run_options(variant, scene.asked, spec, registry);
    options.integrator = choices[i]->integrator();
    options.dt = choices[i]->dt;
    scene.loaded.systems[i] = Simulation(spec, registry, options);
  }
  listen(scene);
  scene.choices = std::move(choices);
  scene.chosen = request;
  scene.chosen_at = ++scene.generation;
}

std::vector<std::string> choice_texts(const sim_scene& scene) {
  std::vector<std::string> texts;
  for (const auto& choice : scene.choices) {
    const std::optional<double> time =
        scene.chosen.time > 0 ? std::optional(scene.chosen.time) : std::nullopt;
    texts.push_back(choice
                        ? report::goal_json(*choice, scene.chosen.of,
                                            command_of(scene) + report::goal_options(*choice, time))
                        : "");
  }
  return texts;
}

}  // namespace sim::c

using namespace sim;
using namespace sim::c;

extern "C" {

char* sim_choose(sim_scene* scene, const char* allowed, const char* of, double time,
                 sim_watch watch, void* user, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    if (std::isnan(time) || std::isinf(time))
      refuse("bad value", "time", "it is not a finite number", "give it in s");
    refuse_in_record(*scene, "choose");
    if (scene->generation != scene->chosen_at)
      refuse("not at its start", "scene",
             "trials begin with the state of the scene, which was stepped or changed since",
             "open it again, and choose first");
    ChoiceRequest request{.of = of ? of : "", .time = time};
    if (allowed) request.error = study::parse_budget("error", allowed);
    Watcher watcher(watch, user);
    stoppable_by(watcher, [&] { stoppable(*scene, [&] { choose(*scene, request, watcher); }); });
    if (watcher.told()) throw Stopped();
    std::vector<std::string> texts = choice_texts(*scene);
    for (std::string& text : texts)
      if (text.empty()) text = "null";
    return given_away(JsonObject().json("systems", json_array(texts)).str());
  });
}

}  // extern "C"
