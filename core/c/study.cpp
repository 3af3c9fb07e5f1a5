// Studies, by the name of their verb.
#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/c/handles.h"
#include "core/c/watcher.h"
#include "core/output/format.h"
#include "core/report/order_report.h"
#include "core/report/rest_report.h"
#include "core/report/stability_report.h"
#include "core/report/study_words.h"
#include "core/report/tradeoff_report.h"
#include "core/study/budget.h"
#include "core/study/method_text.h"

using namespace sim;
using namespace sim::c;

namespace {

// The scene of a study, read again for each variant.
class Source final : public SceneSource {
 public:
  Source(std::string name, const char* text, const Asked& asked, Registry& registry)
      : name_(std::move(name)), text_(text), asked_(asked), registry_(registry) {}

  std::string name() const override { return name_; }
  StudiedScene load(const SceneVariant& variant) override {
    return c::load(name_, text_, asked_, variant, registry_);
  }
  RunOptions options(const SceneVariant& variant, const SystemSpec& system) override {
    return run_options(variant, asked_, system, registry_);
  }
  std::string command(const SceneVariant& variant) const override {
    std::string text = "sim " + name_;
    for (const auto& [name, value] : variant.settings) text += " -s " + name + "=" + value;
    for (const std::string& part : variant.without) text += " --without " + part;
    for (const std::string& part : variant.off) text += " --off " + part;
    return text;
  }

 private:
  std::string name_;
  const char* text_;
  const Asked& asked_;
  Registry& registry_;
};

// The options of a study; each is taken once, and none may be left.
class Words {
 public:
  explicit Words(const char* const* texts) {
    for (; texts && *texts; ++texts) {
      const std::string text = *texts;
      const std::size_t equals = text.find('=');
      if (equals == 0 || equals == std::string::npos)
        refuse("bad word", "asked '" + text + "'", "it is not NAME=VALUE",
               "write it like budget=1%");
      words_[text.substr(0, equals)] = text.substr(equals + 1);
    }
  }

  std::string text(const std::string& name, const std::string& none = "") {
    const auto found = words_.find(name);
    if (found == words_.end()) return none;
    std::string value = found->second;
    words_.erase(found);
    return value;
  }
  std::optional<double> number(const std::string& name) {
    const std::string value = text(name);
    if (value.empty()) return {};
    const std::optional<double> number = parse_number(value);
    if (!number || *number < 0)
      refuse("bad value", name + " '" + value + "'", "it is not a number of at least 0",
             "write it like 0.5");
    return number;
  }
  std::map<std::string, std::string> rest() { return std::move(words_); }
  void finish(const std::string& study) const {
    if (words_.empty()) return;
    refuse("unknown word", words_.begin()->first, "study '" + study + "' does not take it",
           "see sim " + study + " --help");
  }

 private:
  std::map<std::string, std::string> words_;
};

struct Task : StudyTask {
  study::Problem problem(const SystemSpec& spec) const {
    study::Problem problem{&spec, registry, scene->options(variant, spec)};
    problem.of = report::quantity(spec, of);
    return problem;
  }
  std::function<bool()> stop;
};

std::string tradeoff(const Task& task, const SystemSpec& spec, const std::string& budget) {
  study::WorkPrecisionOptions options;
  options.time = task.time.value_or(0);
  options.integrators = task.integrators;
  if (!budget.empty()) {
    const study::Budget asked = study::parse_budget("budget", budget);
    options.budget = asked.value;
    options.budget_in_metres = asked.in_metres;
  }
  const study::Problem problem = task.problem(spec);
  const auto found = study::work_precision(problem, options, task.watch);
  const study::Tried tried = study::try_recommended(problem, *found, task.time, task.stop);
  return report::tradeoff_json(*found, {task.scene->command(task.variant), task.of, task.time},
                               tried);
}

// One JSON text a system.
std::vector<std::string> built_in(const std::string& name, const Task& task, StudiedScene& scene,
                                  Words& words) {
  const std::string budget = name == "tradeoff" ? words.text("budget") : "";
  const double at = name == "stability" ? words.number("at").value_or(0) : 0;
  words.finish(name);
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < scene.systems.size() && !task.stop(); ++i) {
    const SystemSpec& spec = scene.spec.systems[i];
    if (name == "tradeoff") {
      texts.push_back(tradeoff(task, spec, budget));
    } else if (name == "stability") {
      const study::StabilityOptions options{.at = at, .integrators = task.integrators};
      texts.push_back(
          report::stability_json(study::stability(task.problem(spec), options, task.watch)));
    } else if (name == "order") {
      const study::OrderOptions options{task.time.value_or(0), task.integrators};
      texts.push_back(
          report::order_json(*study::order(task.problem(spec), options, task.watch), task.of));
    } else {
      texts.push_back(
          report::rest_json(scene.systems[i], report::rest_of(scene.systems[i], task.stop)));
    }
  }
  return texts;
}

std::string of_plugin(const Plugin<Study>& plugin, const Task& task, Words& words) {
  ValueMap given;
  for (const auto& [name, value] : words.rest()) {
    const auto declared = std::ranges::find(plugin.params, name, &Param::name);
    given[name] =
        declared == plugin.params.end() ? Value(value) : study::value_of(value, *declared);
  }
  const auto study =
      made(plugin.make(Params(plugin.title(), plugin.params, given, "asked")), plugin);
  return study->run(task);
}

std::string studied(const std::string& name, const char* scene, const char* text,
                    const char* const* texts, const sim_options* options, Watcher& watcher) {
  const Asked asked = asked_of(options);
  const auto registry = registry_of(asked, environment_of(asked));
  Source source(scene ? scene : "", text, asked, *registry);
  Words words(texts);
  Task task;
  task.registry = registry.get();
  task.variant = asked.variant;
  task.time = words.number("time");
  task.of = words.text("of");
  std::vector<std::string> methods;
  for (std::string list = words.text("integrators"); !list.empty();) {
    const std::size_t comma = std::min(list.find(','), list.size());
    methods.push_back(list.substr(0, comma));
    list.erase(0, comma + 1);
  }
  for (const MethodChoice& choice : study::parse_integrators(methods))
    task.integrators.push_back(study::typed(choice, choice.name, *registry));
  task.json = true;
  task.watch = [&](std::string_view what, double done) {
    return !watcher.stopped(std::string(what).c_str(), done);
  };
  task.announce = [](double) {};
  task.stop = [&] { return watcher.stopped(name.c_str(), 0.5); };

  const bool known = name == "tradeoff" || name == "stability" || name == "order" || name == "rest";
  if (!known) {
    const Plugin<Study>& plugin = registry->get<Study>(name, "study");
    if (plugin.takes_scene) {
      checked_text(scene, "scene");
      task.scene = &source;
    }
    return of_plugin(plugin, task, words);
  }
  checked_text(scene, "scene");
  task.scene = &source;
  StudiedScene loaded = source.load(task.variant);
  const std::vector<std::string> found = built_in(name, task, loaded, words);
  if (loaded.spec.world) return JsonObject().json("systems", json_array(found)).str();
  return found.empty() ? "" : found.front();
}

}  // namespace

extern "C" {

char* sim_study(const char* study, const char* scene, const char* text, const char* const* asked,
                const sim_options* options, sim_watch watch, void* user, sim_error* error) {
  return guarded_pointer(error, [&] {
    Watcher watcher(watch, user);
    const std::string found =
        studied(checked_text(study, "study"), scene, text, asked, options, watcher);
    if (watcher.told()) throw Stopped();
    return given_away(found);
  });
}

}  // extern "C"
