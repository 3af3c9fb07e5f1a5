// Studies, by the name of their verb.
#include <algorithm>
#include <cmath>
#include <iostream>

#include "core/base/text.h"
#include "core/c/asked_words.h"
#include "core/c/handles.h"
#include "core/c/sweep.h"
#include "core/c/watcher.h"
#include "core/output/file_plan.h"
#include "core/output/format.h"
#include "core/output/make_writer.h"
#include "core/report/comparison.h"
#include "core/report/order_report.h"
#include "core/report/rest_report.h"
#include "core/report/stability_chart.h"
#include "core/report/stability_report.h"
#include "core/report/study_words.h"
#include "core/report/tradeoff_chart.h"
#include "core/report/tradeoff_report.h"
#include "core/report/tradeoff_table.h"
#include "core/study/budget.h"
#include "core/study/method_text.h"

using namespace sim;
using namespace sim::c;

namespace {

// The scene of a study, read again for each variant.
class Source final : public SceneSource {
 public:
  // Functions of the scene end with an error where `stop` says true.
  Source(std::string name, const char* text, const Asked& asked, Registry& registry,
         std::function<bool()> stop)
      : name_(std::move(name)),
        text_(text),
        asked_(asked),
        registry_(registry),
        stop_(std::move(stop)) {}

  std::string name() const override { return name_; }
  StudiedScene load(const SceneVariant& variant) override {
    return c::load(name_, text_, asked_, variant, registry_, stop_);
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
  std::function<bool()> stop_;
};

// 0: the scene's own.
double step_of(const std::string& text) {
  const std::optional<double> number = parse_number(text);
  if (!number || !(*number >= 0 && *number < HUGE_VAL))
    refuse("bad value", "dt '" + text + "'", "it is not a number of at least 0",
           "give it in s, or 0 for the scene's own");
  return *number;
}

struct Task : StudyTask {
  study::Problem problem(const SystemSpec& spec) const {
    study::Problem problem{&spec, registry, scene->options(variant, spec)};
    problem.of = report::quantity(spec, of);
    return problem;
  }
  std::function<bool()> stop;
};

// The files of a study, which take their names when it is done.
struct StudyFiles {
  // Empty names: none. Throws Error.
  StudyFiles(const StudiedScene& scene, const Registry& registry, const std::string& table_file,
             const std::string& plot_file) {
    FilePlan plan;
    plan_inputs(scene.spec, registry, plan);
    if (!table_file.empty()) plan.writes("csv", table_file);
    if (!plot_file.empty()) plan.writes("svg", plot_file);
    plan.check();
    if (!plot_file.empty() && scene.systems.size() > 1)
      refuse("one plot for several systems", "svg '" + plot_file + "'", "the scene is a world",
             "name the file of one of its scenes");
    if (!table_file.empty())
      table.emplace(parse_target("csv", checked_file(table_file.c_str(), "a table")), std::cout);
    if (!plot_file.empty()) plot.emplace(checked_file(plot_file.c_str(), "a plot"));
  }
  void commit() {
    if (table) table->commit();
    if (plot) plot->commit();
  }

  std::optional<report::TradeoffTable> table;
  std::optional<Output> plot;
};

std::string tradeoff(const Task& task, const SystemSpec& spec, const std::string& budget,
                     StudyFiles& files) {
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
  if (files.table) files.table->add(*found);
  if (files.plot) files.plot->buffer() += report::chart_of(*found);
  return report::tradeoff_json(*found, {task.scene->command(task.variant), task.of, task.time},
                               tried);
}

// The method of place i in a list, the last one holding for all behind it.
template <class Listed>
Listed listed(const std::vector<Listed>& list, std::size_t i, Listed none) {
  return list.empty() ? none : list[std::min(i, list.size() - 1)];
}

std::string compare(const Task& task, const StudiedScene& scene, AskedWords& words) {
  const SystemSpec& spec = scene.spec.systems.front();
  if (scene.spec.world)
    refuse("several systems", task.scene->name(), "it is a world",
           "name the file of one of its scenes");
  std::vector<double> steps;
  for (const std::string& text : words.list("dt")) steps.push_back(step_of(text));
  report::ComparisonTask compared{
      .problem = task.problem(spec), .name = task.scene->name(), .time = task.time, .of = task.of};
  compared.problem.of = {};
  const std::size_t methods = std::max(task.integrators.size(), steps.size());
  if (steps.size() > 1 && task.integrators.size() > 1 && steps.size() != task.integrators.size())
    refuse("steps without methods", std::to_string(steps.size()) + " of dt",
           std::to_string(task.integrators.size()) + " integrators",
           "give one dt for all, or one for each");
  for (std::size_t i = 0; i < methods; ++i)
    compared.methods.push_back(
        {listed(task.integrators, i, task.variant.integrator), listed(steps, i, task.variant.dt)});
  const std::string reference = words.text("reference"), dt = words.text("reference_dt");
  if (!reference.empty() || !dt.empty())
    compared.reference = {study::parse_integrator(reference), dt.empty() ? 0 : step_of(dt)};
  const std::vector<std::string> files = words.all("out");
  LookSpec look{.camera = words.text("camera"),
                .color = words.text("color"),
                .size = words.text("size"),
                .springs = words.all("springs"),
                .wireframe = words.flag("wireframe", false),
                .surface = words.flag("surface", false),
                .trails = words.all("trails")};
  if (const std::optional<double> fps = words.number("fps")) {
    if (!(*fps >= 1e-6 && *fps <= 1e6))
      refuse("bad value", "fps " + brief(*fps), "it is out of range", "30 is usual");
    compared.fps = *fps;
  }
  words.finish("compare");
  FilePlan plan;
  plan_inputs(scene.spec, *task.registry, plan);
  for (const std::string& file : files) {
    writer_of(file, *task.registry);
    for (const std::string& name : written_names(file)) plan.writes("out", name);
  }
  plan.check();
  report::Comparison comparison(compared);
  if (!comparison.run(task.watch)) return "";
  if (!files.empty()) comparison.write(files, look, task.stop);
  return comparison.json();
}

// One JSON text a system.
std::vector<std::string> built_in(const std::string& name, const Task& task, StudiedScene& scene,
                                  AskedWords& words) {
  const bool plots = name == "tradeoff" || name == "stability";
  const std::string budget = name == "tradeoff" ? words.text("budget") : "";
  const std::string table = name == "tradeoff" ? words.text("csv") : "";
  const std::string plot = plots ? words.text("svg") : "";
  const double at = name == "stability" ? words.number("at").value_or(0) : 0;
  words.finish(name);
  StudyFiles files(scene, *task.registry, table, plot);
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < scene.systems.size() && !task.stop(); ++i) {
    const SystemSpec& spec = scene.spec.systems[i];
    if (name == "tradeoff") {
      texts.push_back(tradeoff(task, spec, budget, files));
    } else if (name == "stability") {
      const study::StabilityOptions options{.at = at, .integrators = task.integrators};
      const study::Stability found = study::stability(task.problem(spec), options, task.watch);
      if (files.plot) files.plot->buffer() += report::chart_of(found);
      texts.push_back(report::stability_json(found));
    } else if (name == "order") {
      const study::OrderOptions options{task.time.value_or(0), task.integrators};
      texts.push_back(
          report::order_json(*study::order(task.problem(spec), options, task.watch), task.of));
    } else {
      texts.push_back(
          report::rest_json(scene.systems[i], report::rest_of(scene.systems[i], task.stop)));
    }
  }
  if (!task.stop()) files.commit();
  return texts;
}

std::string of_plugin(const Plugin<Study>& plugin, const Task& task, AskedWords& words) {
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
  AskedWords words(texts);
  if (name == "sweep") return sweep(checked_text(scene, "scene"), text, asked, words, watcher);
  const auto registry = registry_of(asked, environment_of(asked));
  Task task;
  task.stop = [&] { return watcher.stopped(name.c_str(), 0.5); };
  Source source(scene ? scene : "", text, asked, *registry, task.stop);
  task.registry = registry.get();
  task.variant = asked.variant;
  task.time = words.number("time");
  task.of = words.text("of");
  const std::vector<std::string> methods = words.list("integrators");
  for (const MethodChoice& choice : study::parse_integrators(methods))
    task.integrators.push_back(study::typed(choice, choice.name, *registry));
  task.json = true;
  task.watch = [&](std::string_view what, double done) {
    return !watcher.stopped(std::string(what).c_str(), done);
  };
  task.announce = [](double) {};
  const bool known = name == "tradeoff" || name == "stability" || name == "order" ||
                     name == "rest" || name == "compare";
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
  if (name == "compare") return compare(task, loaded, words);
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
    const std::string found = stoppable_by(watcher, [&] {
      return studied(checked_text(study, "study"), scene, text, asked, options, watcher);
    });
    if (watcher.told()) throw Stopped();
    return given_away(found);
  });
}

}  // extern "C"
