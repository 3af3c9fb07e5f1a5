#include "core/report/tradeoff_report.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/report/study_words.h"

namespace sim::report {

using study::Curve;
using study::Point;
using study::Tried;
using study::WorkPrecision;
using PlaceOf = study::Place;

const char* point_status(const WorkPrecision& study, const Point& point) {
  if (!point.finished) return "diverged";
  return study::stable(point, study.size) ? "finite" : "unstable";
}

JsonObject point_json(const WorkPrecision& study, PlaceOf place) {
  const Point& point = study.at(place);
  JsonObject object;
  object.number("dt", point.dt).number("tol", point.tolerance);
  return object.text("status", point_status(study, point))
      .number("error", point.finished ? point.rms : std::nan(""))
      .number("relative", point.finished ? point.rms / study.size : std::nan(""))
      .number("error_end", point.finished ? point.rms_end : std::nan(""))
      .number("max_end", point.finished ? point.most_end : std::nan(""))
      .integer("worst", point.worst)
      .number("energy", point.energy)
      .number("phi", point.drift ? point.drift->position : std::nan(""))
      .number("phi_rate", point.drift ? point.drift->velocity : std::nan(""))
      .integer("steps", point.steps)
      .integer("evaluations", point.effort.evaluations)
      .integer("newton", point.effort.newton)
      .integer("factorisations", point.effort.factorisations)
      .integer("linear", point.effort.linear)
      .number("cost", study.cost(place))
      .number("seconds", point.seconds)
      .number("spread", point.spread)
      .flag("front", on_front(study, place));
}

namespace {

const Curve& curve_of(const WorkPrecision& study, PlaceOf place) {
  return study.curves[place.curve];
}

// "sim scenes/cloth.lua -i verlet -d 0.00625": as a run would be told.
std::string command_text(const WorkPrecision& study, PlaceOf place, const TradeoffAsked& asked) {
  const Point& point = study.at(place);
  std::string text = asked.command + " -i " + curve_of(study, place).method.label;
  text += point.tolerance > 0 ? " --tol " + brief(point.tolerance) : " -d " + shortest(point.dt);
  return asked.time ? text + " -T " + shortest(*asked.time) : text;
}

double known_to(const WorkPrecision& study) {
  return study.yardstick.floor() / (study.yardstick.figure ? 1 : 10);
}

std::string growth_text(const WorkPrecision& study) {
  if (study.growth.most.empty()) return "not measured";
  const double mean = study.growth.mean.back(), most = study.growth.most.back();
  return "a disturbance at the start " +
         std::string(most > 1 ? "grows to x" : "does not grow: at the end it is x") +
         brief(mean, 2) + " of itself (x" + brief(most, 2) + " at most)";
}

// Says why a method has no stable point.
std::string hopeless_text(const Curve& curve) {
  if (curve.points.empty())
    return "not tried: " + std::to_string(study::kIntervals) + " steps take too long";
  const Point& last = curve.points.back();
  const std::string down = last.tolerance > 0
                               ? "tolerance tried, down to " + brief(last.tolerance, 3)
                               : "step tried, down to " + brief(last.dt, 3) + " s";
  return "unstable at every " + down + (curve.late ? "; finer runs take too long" : "");
}

// Rows worth reading: the front, and of every method its cheapest point within the budget, or else
// its most accurate one.
std::vector<PlaceOf> rows(const WorkPrecision& study) {
  std::vector<PlaceOf> places = study.front;
  for (std::size_t c = 0; c < study.curves.size(); ++c) {
    std::optional<PlaceOf> best;
    for (std::size_t p = 0; p < study.curves[c].points.size(); ++p) {
      const PlaceOf here{c, p};
      const Point& point = study.at(here);
      if (!study::stable(point, study.size)) continue;
      const bool within = point.rms <= study.budget;
      const auto better = [&] {
        const bool other = study.at(*best).rms <= study.budget;
        if (within != other) return within;
        return within ? study.cost(here) < study.cost(*best) : point.rms < study.at(*best).rms;
      };
      if (!best || better()) best = here;
    }
    if (best && !on_front(study, *best)) places.push_back(*best);
  }
  std::stable_sort(places.begin(), places.end(),
                   [&](PlaceOf a, PlaceOf b) { return study.cost(a) < study.cost(b); });
  return places;
}

std::string order_text(const Curve& curve) {
  return std::to_string(curve.method.info.order) + "/" +
         (curve.observed ? brief(curve.observed->slope, 2) : "-");
}

// Nothing smaller than what the reference can tell.
std::string error_text(const WorkPrecision& study, const Point& point) {
  const double floor = study.yardstick.floor();
  return point.rms > floor ? brief(point.rms, 3) : "<" + brief(floor, 2);
}

// Two digits, and no power of ten where that is as wide as the column.
std::string milliseconds(double seconds) {
  return seconds < 0.0995 ? brief(1e3 * seconds, 2) : std::to_string(std::lround(1e3 * seconds));
}

// Six digits and more would fill the column.
std::string cost_text(double cost) { return brief(cost, cost < 99999.5 ? 5 : 3); }

// It has constraints, of which the methods leave some.
bool drifts(const WorkPrecision& study) {
  return std::ranges::any_of(study.curves, [](const Curve& curve) {
    return !curve.points.empty() && curve.points.front().drift;
  });
}

std::string table_text(const WorkPrecision& study) {
  const bool drift = drifts(study);
  std::size_t width = 13;
  for (const Curve& curve : study.curves) width = std::max(width, curve.method.label.size() + 2);
  width = std::min<std::size_t>(width, drift ? 13 : 21);
  std::string text = "  " + left("integrator", width - 2) + right("order", 7) +
                     right("dt, tol", 9) + right("cost", 9) +
                     right(study.unit.empty() ? "error" : "error [m]", 10) +
                     (drift ? "" : right("of size", 9)) + right("energy", 8) + right("ms", 7) +
                     (drift ? right("phi [m]", 9) + right("[m/s]", 8) : "") + '\n';
  for (const PlaceOf place : rows(study)) {
    const Curve& curve = curve_of(study, place);
    const Point& point = study.at(place);
    text += (on_front(study, place) ? "* " : "  ") + first_cell(curve.method.label, width - 2) +
            right(order_text(curve), 7) +
            right(brief(point.tolerance > 0 ? point.tolerance : point.dt, 3), 9) +
            right(cost_text(study.cost(place)), 9) + right(error_text(study, point), 10) +
            (drift ? "" : right(brief(point.rms / study.size, 2), 9)) +
            right(std::isfinite(point.energy) ? brief(point.energy, 2) : "-", 8) +
            right(milliseconds(point.seconds), 7) +
            (point.drift ? right(brief(point.drift->position, 2), 9) +
                               right(brief(point.drift->velocity, 2), 8)
                         : "") +
            '\n';
  }
  for (const Curve& curve : study.curves)
    if (std::none_of(curve.points.begin(), curve.points.end(),
                     [&](const Point& point) { return study::stable(point, study.size); }))
      text += "  " + wrapped(curve.method.label + ": " + hopeless_text(curve), 4, 2) + '\n';
  return text +
         "* on the front: nothing is cheaper and closer. order: claimed/observed. cost:\n"
         "evaluations of f; implicit methods and single precision at what their time is\n"
         "worth. error: " +
         (study.yardstick.figure
              ? "of the figure of the whole run, as its own steps see it.\n"
              : "rms of " + std::string(study.unit.empty() ? "the numbers" : "positions") +
                    ", the largest of all steps.\n") +
         (drift ? "phi, [m/s]: how far the constraints and their rates are off at the end\n" : "");
}

std::string with_unit(const WorkPrecision& study, double value, int digits) {
  return brief(value, digits) + (study.unit.empty() ? "" : " " + study.unit);
}

std::string off_text(const WorkPrecision& study, const Point& point) {
  const double floor = study.yardstick.floor();
  return (point.rms > floor ? "" : "less than ") + with_unit(study, std::max(point.rms, floor), 2);
}

std::string verdict_text(const study::Verdict& verdict) {
  return std::string(study::trust_name(verdict.trust)) + ": " + verdict.reason;
}

std::string recommendation(const WorkPrecision& study, const TradeoffAsked& asked,
                           const Tried& tried) {
  const std::string budget = with_unit(study, study.budget, 3);
  if (study.comparable == 0)
    return "no recommendation: " +
           (study.yardstick.figure ? asked.of + " is not known to "
                                   : "the motion is not known to ") +
           with_unit(study, study.needed(), 2) + " for any time\n";
  std::string text;
  if (!tried.refused.empty())
    text = wrapped("not recommended, though within " + budget + ": " +
                       counted(static_cast<long>(tried.refused.size()), "choice") +
                       " of which the run is suspect; that of the last is " +
                       verdict_text(tried.refused.back()),
                   2) +
           "\n  " + command_text(study, study.refused.back(), asked) + '\n';
  if (!study.cheapest)
    return text + (text.empty() ? "no recommendation: no step tried is within " + budget + "\n"
                                : "no recommendation: no other step is within it\n");
  if (study.recommended) {
    const Point& point = study.at(*study.recommended);
    text += wrapped("recommended for " + budget + ": off by " + off_text(study, point) + ", " +
                        brief(study.cost(*study.recommended) / study.time, 4) + " evaluations/s (" +
                        brief(study.time / point.seconds, 2) + "x real time)",
                    2) +
            "\n  " + command_text(study, *study.recommended, asked) + '\n';
    if (tried.recommended)
      text += wrapped("that run is " + verdict_text(*tried.recommended), 2) + '\n';
  } else {
    text += "no step within " + budget + " is well inside its limit of stability\n";
  }
  const bool same = study.recommended && study.recommended->curve == study.cheapest->curve &&
                    study.recommended->point == study.cheapest->point;
  if (same) return text;
  return text + "cheapest within it: off by " + off_text(study, study.at(*study.cheapest)) + ", " +
         brief(100 * study.cost(*study.cheapest) /
                   study.cost(study.recommended ? *study.recommended : *study.cheapest),
               3) +
         " % of the cost\n  " + command_text(study, *study.cheapest, asked) + '\n';
}

std::string choice_json(const WorkPrecision& study, const std::optional<PlaceOf>& place,
                        const TradeoffAsked& asked, const std::optional<study::Verdict>& verdict) {
  if (!place) return "null";
  const Point& point = study.at(*place);
  JsonObject object;
  object.text("integrator", curve_of(study, *place).method.label);
  point.tolerance > 0 ? object.number("tol", point.tolerance) : object.number("dt", point.dt);
  object.number("error", point.rms)
      .integer("evaluations", point.effort.evaluations)
      .number("cost", study.cost(*place))
      .text("command", command_text(study, *place, asked));
  if (verdict)
    object.text("verdict", study::trust_name(verdict->trust)).text("reason", verdict->reason);
  return object.str();
}

}  // namespace

std::string tradeoff_text(const WorkPrecision& study, const TradeoffAsked& asked,
                          const Tried& tried) {
  const std::string system = study.system + " to t = " + brief(study.time) + " s, " +
                             (asked.of.empty() ? "size " : "range ") +
                             with_unit(study, study.size, 4);
  if (study.reference.points.empty()) return label("system", system);  // cut short
  std::string text = label("system", system + ", fastest " + brief(study.fastest.omega) + " rad/s");
  text += label(
      "reference",
      wrapped(study.reference.how + ", known to " + with_unit(study, known_to(study), 2), 12, 12));
  if (study.yardstick.figure)
    text += label("judged", judged_text(asked.of, study.reference.figure, known_to(study)));
  if (asked.of.empty()) text += label("growth", wrapped(growth_text(study), 12, 12));
  if (study.comparable < study.time && !study.yardstick.figure)
    text += label(
        grows_too_far(study) ? "chaotic" : "compared",
        wrapped("beyond t = " + brief(study.comparable) + " s " +
                    (grows_too_far(study) ? asked.of.empty() ? "positions are" : asked.of + " is"
                                          : "the reference is") +
                    " not known to " + with_unit(study, study.needed(), 2) +
                    "; compared until then",
                12, 12));
  if (!study.curves.empty()) text += '\n' + table_text(study);
  return text + '\n' + recommendation(study, asked, tried);
}

std::string tradeoff_json(const WorkPrecision& study, const TradeoffAsked& asked,
                          const Tried& tried) {
  std::vector<std::string> curves, refused;
  for (std::size_t k = 0; k < tried.refused.size(); ++k)
    refused.push_back(choice_json(study, study.refused[k], asked, tried.refused[k]));
  for (std::size_t c = 0; c < study.curves.size(); ++c) {
    const Curve& curve = study.curves[c];
    std::vector<std::string> points;
    for (std::size_t p = 0; p < curve.points.size(); ++p)
      points.push_back(point_json(study, {c, p}).str());
    curves.push_back(JsonObject()
                         .text("name", curve.method.label)
                         .integer("order", curve.method.info.order)
                         .number("observed", curve.observed ? curve.observed->slope : std::nan(""))
                         .number("limit", curve.limit.value_or(std::nan("")))
                         .json("points", json_array(points))
                         .str());
  }
  const bool known = !study.reference.points.empty();
  const bool grown = !study.growth.most.empty();
  return JsonObject()
      .text("system", study.system)
      .number("time", study.time)
      .json("of", asked.of.empty() ? "null" : json_string(asked.of))
      .number("figure", study.reference.figure)
      .number("size", study.size)
      .number("budget", study.budget)
      .number("comparable", study.comparable)
      .json("reference", JsonObject()
                             .text("how", study.reference.how)
                             .number("error", known ? known_to(study) : std::nan(""))
                             .str())
      .number("growth", grown ? study.growth.most.back() : std::nan(""))
      .number("omega_max", known ? study.fastest.omega : std::nan(""))
      .flag("complete", study.complete)
      .json("recommended", choice_json(study, study.recommended, asked, tried.recommended))
      .json("cheapest", choice_json(study, study.cheapest, asked, {}))
      .json("refused", json_array(refused))
      .json("integrators", json_array(curves))
      .str();
}

}  // namespace sim::report
