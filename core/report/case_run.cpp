#include "core/report/case_run.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/stopwatch.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/summary.h"
#include "core/study/method_text.h"
#include "core/study/problem.h"
#include "core/study/run/follow.h"

namespace sim::report {
namespace {

using study::Track;

const std::vector<std::string>& run_names() {
  static const std::vector<std::string> names{"integrator", "dt", "tol", "time", "steps", "seed"};
  return names;
}

std::string field(double value) { return std::isfinite(value) ? shortest(value) : ""; }

std::vector<std::string> fields_of(Track& track, int exit, const std::string& reason,
                                   const std::vector<std::string>& observed, double seconds) {
  const Simulation& system = track.system();
  const study::Verdict verdict = track.verdict();
  const study::Figures& figures = verdict.figures;
  const bool lost = verdict.trust == study::Trust::kDiverged;  // then its figures say nothing
  const auto figure = [&](double value) { return lost ? "" : field(value); };
  const bool energy = !lost && system.second_order() && track.energy_is_finite();
  std::vector<std::string> fields{
      std::to_string(exit),
      study::trust_name(verdict.trust),
      in_one_line(reason.empty() ? verdict.reason : reason),
      std::to_string(system.step_count()),
      std::to_string(study::evaluations_of(system)),
      field(system.t()),
      energy ? field(track.energy().kinetic) : "",
      energy ? field(track.energy().potential) : "",
      energy ? field(track.energy().total()) : "",
      energy ? field(track.drift()) : "",
      figure(figures.energy),
      field(figures.dt_share),
      figures.strain.a < 0 ? "" : figure(figures.strain.strain),
      figure(figures.step_error),
      figure(track.has_exact() ? track.deviation().error : figures.shadow.error),
      hash_text(system)};
  const auto values = track.observed();
  for (const std::string& name : observed) {
    fields.emplace_back();
    for (std::size_t i = 0; i < values.size(); ++i)
      if (track.observers()[i].name == name) fields.back() = field(values[i]);
    for (std::size_t i = 0; i < track.judged().size(); ++i)
      if (track.judged()[i].text() == name) fields.back() = field(track.figure(i));
  }
  fields.push_back(brief(seconds, 3));
  return fields;
}

double positive_value(const std::string& name, const std::string& text) {
  const auto value = parse_number(text);
  if (!value || !(*value > 0))
    throw Error(ErrorKind::kUsage,
                {"bad value in a sweep", name + " = '" + text + "'", "it is a number above 0", ""});
  return *value;
}

std::int64_t whole_value(const std::string& name, const std::string& text) {
  const auto value = parse_integer(text);
  if (!value || *value < 0 || *value > study::kMostSteps)
    throw Error(ErrorKind::kUsage, {"bad value in a sweep", name + " = '" + text + "'",
                                    "it is a whole number of at least 0", ""});
  return *value;
}

// Names, hashes and reasons are texts, whatever they look like.
std::string json_field(const std::string& column, const std::string& text) {
  if (text.empty()) return "null";
  if (column != "verdict" && column != "reason" && column != "hash")
    if (const auto value = parse_number(text)) return text;
  return json_string(text);
}

}  // namespace

std::string in_one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  return text;
}

CaseValues values_of(const SweepCases& cases, std::size_t index, CaseValues values) {
  std::optional<double> tolerance;
  for (std::size_t i = 0; i < cases.names.size(); ++i) {
    const std::string &name = cases.names[i], &value = cases.rows[index][i];
    if (name == "integrator") {
      values.integrator = study::parse_integrator(value);
    } else if (name == "dt") {
      values.dt = positive_value(name, value);
    } else if (name == "tol") {
      tolerance = positive_value(name, value);
    } else if (name == "time") {
      values.length = {positive_value(name, value), {}};
    } else if (name == "steps") {
      values.length = {{}, whole_value(name, value)};
    } else if (name == "seed") {
      values.seed = static_cast<std::uint64_t>(whole_value(name, value));
    } else {
      values.settings[name] = value;
    }
  }
  if (tolerance && !values.integrator.given.emplace("tol", *tolerance).second)
    throw Error(ErrorKind::kUsage,
                {"given twice", "tol and integrator " + values.integrator.name + ":tol=",
                 "only one of them can hold", "keep one of them"});
  return values;
}

void check_cases(const SweepCases& cases, const SceneSpec& scene, const std::string& name) {
  if (scene.world)
    throw Error(ErrorKind::kUsage,
                {"several systems", name, "it is a world", "name the file of one of its scenes"});
  std::vector<std::string> known = run_names();
  for (const SceneArg& arg : scene.args) known.push_back(arg.name);
  for (const std::string& each : cases.names)
    if (std::ranges::find(known, each) == known.end())
      throw Error(ErrorKind::kUsage,
                  {"unknown name in a sweep", "'" + each + "'",
                   "neither a run nor the scene has it", suggestion(each, known)});
  if (cases.has("time") && cases.has("steps"))
    throw Error(ErrorKind::kUsage, {"two lengths of a run", "time and steps",
                                    "only one of them can hold", "keep one of them"});
}

std::vector<std::string> observed_columns(const SystemSpec& system,
                                          const std::vector<std::string>& of) {
  std::vector<std::string> columns;
  for (const ObserverSpec& observer : system.observers) columns.push_back(observer.name);
  for (const std::string& text : of)
    if (study::Quantity(system, text).is_figure()) columns.push_back(text);
  return columns;
}

const std::vector<std::string>& case_columns() {
  static const std::vector<std::string> names{
      "exit",  "verdict", "reason", "steps",    "evaluations", "t",          "kinetic", "potential",
      "total", "drift",   "energy", "dt_share", "strain",      "step_error", "error",   "hash"};
  return names;
}

JudgedCase::JudgedCase(StudiedScene& scene, Registry& registry, CaseTask task)
    : task_(std::move(task)),
      track_(scene.spec.systems.front(), scene.systems.front(),
             study::steps_of(task_.length, scene.systems.front()), Track::kNever, Track::kNever,
             &registry) {
  study::shorten(task_.length, track_);
  std::vector<study::Quantity> figures;
  for (const std::string& text : task_.of) figures.emplace_back(scene.spec.systems.front(), text);
  track_.judge(figures);
}

void JudgedCase::run() {
  track_.system().stop_when(task_.stop);  // in long steps
  study::follow(track_, task_.stop);
}

std::vector<std::string> JudgedCase::row(double seconds) {
  if (task_.verify)
    track_.verify(task_.stop);
  else
    track_.leave_unverified("positions not verified");
  const study::Verdict verdict = track_.verdict();
  int exit = verdict.trust == study::Trust::kDiverged ? static_cast<int>(ErrorKind::kDiverged) : 0;
  std::string reason;
  if (task_.check && exit == 0) try {
      task_.check(verdict, track_.system().name());
    } catch (const Error& error) {
      exit = static_cast<int>(error.kind());
      reason = error.what();
    }
  return fields_of(track_, exit, reason, task_.observed, seconds);
}

std::vector<std::string> run_case(StudiedScene& scene, Registry& registry, const CaseTask& task) {
  JudgedCase judged(scene, registry, task);
  const Stopwatch watch;
  judged.run();
  return judged.row(watch.seconds());
}

std::vector<std::string> lost_case(int exit, const std::string& reason, std::size_t observed) {
  std::vector<std::string> fields(case_columns().size() + observed + 1);
  fields[0] = std::to_string(exit);
  fields[2] = in_one_line(reason);
  return fields;
}

std::string case_json(const SweepCases& cases, std::size_t index,
                      const std::vector<std::string>& observed,
                      const std::vector<std::string>& fields) {
  JsonObject row;
  row.integer("case", static_cast<std::int64_t>(index));
  for (std::size_t i = 0; i < cases.names.size(); ++i)
    row.json(cases.names[i], json_field(cases.names[i], cases.rows[index][i]));
  std::size_t next = 0;
  for (const auto* names : {&case_columns(), &observed})
    for (const std::string& name : *names) row.json(name, json_field(name, fields[next++]));
  return row.json("seconds", json_field("seconds", fields[next])).str();
}

}  // namespace sim::report
