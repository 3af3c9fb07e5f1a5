#include "cli/verbs/order.h"

#include <algorithm>
#include <cmath>

#include "cli/run/study_progress.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/study/accuracy/order.h"

namespace sim::cli {
namespace {

using study::MethodOrder;
using study::OrderStudy;
using study::Point;

constexpr std::size_t kNumber = 12;

double known_to(const OrderStudy& result) {
  return result.reference.error.empty()
             ? std::nan("")
             : *std::max_element(result.reference.error.begin(), result.reference.error.end());
}

std::string observed_text(const MethodOrder& each) {
  if (!each.observed) return "-";
  return brief(each.observed->slope, 3) + " +- " + brief(each.observed->standard_error, 1);
}

std::string remark(const MethodOrder& each) {
  if (!each.observed) return "no three steps agree on an order";
  if (!study::keeps_order(each)) return "below its order: a kink in the motion, or a fault";
  return "";
}

// The smallest step that still says something, and its error.
const Point* finest(const OrderStudy& result, const MethodOrder& each) {
  const Point* best = nullptr;
  for (const Point& point : each.points)
    if (point.finished && point.rms > result.yardstick.floor()) best = &point;
  return best;
}

std::string error_head(const OrderStudy& result) {
  return result.unit.empty() ? "error" : "error [m]";
}

std::string with_unit(const OrderStudy& result, double value, int digits) {
  return brief(value, digits) + (result.unit.empty() ? "" : " " + result.unit);
}

std::string table_text(const OrderStudy& result) {
  std::size_t width = 12;
  for (const MethodOrder& each : result.methods)
    width = std::max(width, each.method.label.size() + 2);
  std::string text = left("integrator", width) + right("order", 6) + right("observed", 18) +
                     right("smallest", kNumber) + right(error_head(result), kNumber) + '\n';
  for (const MethodOrder& each : result.methods) {
    const Point* point = finest(result, each);
    const double step = !point ? 0 : point->tolerance > 0 ? point->tolerance : point->dt;
    std::string line =
        left(each.method.label, width) + right(std::to_string(each.method.info.order), 6) +
        right(observed_text(each), 18) + right(point ? brief(step, 3) : "-", kNumber) +
        right(point ? brief(point->rms, 3) : "-", kNumber);
    const std::string words = remark(each);
    text += line + '\n';
    if (!words.empty()) text += "  " + words + '\n';
  }
  return text +
         "smallest: the smallest step in s (or tolerance) whose error is above what the\n"
         "reference knows. error: rms, the largest of all steps. +-: what is left of the\n"
         "fit of a line, not how sure it is.\n";
}

// Every step of one method.
std::string steps_text(const OrderStudy& result, const MethodOrder& each) {
  std::string text = '\n' +
                     right(each.points.front().tolerance > 0 ? "tolerance" : "dt [s]", kNumber) +
                     right("evaluations", kNumber) + right(error_head(result), kNumber) +
                     right("local order", kNumber) + '\n';
  const Point* last = nullptr;
  for (const Point& point : each.points) {
    const bool below = point.finished && point.rms <= result.yardstick.floor();
    text += right(brief(point.tolerance > 0 ? point.tolerance : point.dt, 5), kNumber) +
            right(std::to_string(point.effort.evaluations), kNumber) +
            right(!point.finished ? "diverges"
                  : below         ? "<" + brief(result.yardstick.floor(), 2)
                                  : brief(point.rms, 4),
                  kNumber);
    const double ratio = last ? (point.tolerance > 0 ? static_cast<double>(point.steps) /
                                                           static_cast<double>(last->steps)
                                                     : last->dt / point.dt)
                              : 0;
    if (last && point.finished && !below && ratio > 1)
      text += right(brief(std::log(last->rms / point.rms) / std::log(ratio), 3), kNumber);
    text += '\n';
    last = point.finished ? &point : nullptr;
  }
  return text;
}

std::string text_of(const OrderStudy& result, const std::string& of) {
  std::string text = label("system", result.system + " to t = " + brief(result.time) +
                                         (of.empty() ? " s, size " : " s, range ") +
                                         with_unit(result, result.size, 4));
  if (!of.empty())
    text += label("judged", result.yardstick.figure && !result.reference.points.empty()
                                ? judged_text(of, result.reference.figure, known_to(result))
                                : of);
  if (!result.reference.points.empty())
    text += label("reference", wrapped(result.reference.how + ", known to " +
                                           with_unit(result, known_to(result), 2),
                                       12, 12)) +
            '\n' + table_text(result);
  if (result.methods.size() == 1) text += steps_text(result, result.methods.front());
  return text;
}

std::string method_json(const MethodOrder& each) {
  std::vector<std::string> points;
  for (const Point& point : each.points) {
    JsonObject object;
    object.number("dt", point.dt);
    if (point.tolerance > 0) object.number("tol", point.tolerance);
    points.push_back(object.number("error", point.finished ? point.rms : std::nan(""))
                         .flag("finished", point.finished)
                         .integer("evaluations", point.effort.evaluations)
                         .str());
  }
  const auto& observed = each.observed;
  return JsonObject()
      .text("name", each.method.label)
      .integer("order", each.method.info.order)
      .number("observed", observed ? observed->slope : std::nan(""))
      .number("standard_error", observed ? observed->standard_error : std::nan(""))
      .number("constant", observed ? observed->constant : std::nan(""))
      .flag("keeps", study::keeps_order(each))
      .json("points", json_array(points))
      .str();
}

std::string json_of(const OrderStudy& result, const std::string& of) {
  std::vector<std::string> methods;
  for (const MethodOrder& each : result.methods) methods.push_back(method_json(each));
  return JsonObject()
      .text("system", result.system)
      .number("time", result.time)
      .json("of", of.empty() ? "null" : json_string(of))
      .number("figure", result.reference.figure)
      .number("size", result.size)
      .json("reference",
            JsonObject().text("how", result.reference.how).number("error", known_to(result)).str())
      .flag("complete", result.complete)
      .json("integrators", json_array(methods))
      .str();
}

bool is_integrator(const std::string& word, Registry& registry) {
  return registry.find(kind_of<Integrator>, word.substr(0, word.find(':')));
}

}  // namespace

int order(const OrderRequest& request, const Environment& environment, Registry& registry,
          Console& console) {
  SceneRequest scene_request = request.scene;
  std::vector<MethodChoice> integrators = request.integrators;
  std::vector<std::string> words = request.words;
  if (words.size() == 2 && !is_integrator(words[0], registry) && is_integrator(words[1], registry))
    std::swap(words[0], words[1]);
  if (!words.empty() && (words.size() > 1 || is_integrator(words.front(), registry))) {
    if (!integrators.empty())
      throw Error(ErrorKind::kUsage, {"given twice", "'" + words.front() + "' and --integrators",
                                      "as an argument and as an option", "keep one of them"});
    integrators = {parse_integrator(words.front())};
    words.erase(words.begin());
  }
  if (!words.empty()) scene_request.scene = words.front();

  const LoadedScene scene = load(scene_request, environment, registry);
  StudyProgress progress(request.progress, console);
  std::vector<std::string> texts;
  for (const SystemSpec& spec : scene.spec.systems) {
    if (progress.caught()) break;
    study::Problem problem{&spec, &registry, run_options(scene_request, spec, registry)};
    problem.of = quantity(spec, request.of);
    const study::OrderOptions options{request.time.value_or(0),
                                      study_choices(integrators, registry)};
    progress.announce(study::expected(problem, options));
    const auto result = study::order(problem, options, progress.watch());
    texts.push_back(request.json ? json_of(*result, request.of) : text_of(*result, request.of));
  }
  progress.clear();
  put_studies(texts, request.json, scene.spec.world, console);
  return progress.exit_code();
}

}  // namespace sim::cli
