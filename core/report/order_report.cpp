#include "core/report/order_report.h"

#include <algorithm>
#include <cmath>

#include "core/math/elementary.h"
#include "core/output/format.h"
#include "core/report/study_words.h"

namespace sim::report {
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
      text +=
          right(brief(elementary::log(last->rms / point.rms) / elementary::log(ratio), 3), kNumber);
    text += '\n';
    last = point.finished ? &point : nullptr;
  }
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

}  // namespace

std::string order_text(const OrderStudy& result, const std::string& of) {
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

std::string order_json(const OrderStudy& result, const std::string& of) {
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

}  // namespace sim::report
