#include "core/report/goal_report.h"

#include <cmath>

#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::report {

using study::GoalCandidate, study::GoalChoice;

double over_cheapest(const GoalChoice& choice) {
  if (!choice.kept) return std::nan("");
  const double least = choice.candidates.empty() ? choice.cost : choice.candidates.front().cost;
  return std::isfinite(least) && least > 0 ? choice.cost / least : std::nan("");
}

std::string goal_options(const GoalChoice& choice, const std::optional<double>& time) {
  std::string text = " -i " + choice.method->label;
  if (choice.tolerance > 0) text += " --tol " + shortest(choice.tolerance);
  text += " -d " + shortest(choice.dt);
  return time ? text + " -T " + shortest(*time) : text;
}

std::string goal_json(const GoalChoice& choice, const std::string& of, const std::string& command) {
  std::vector<std::string> candidates;
  for (const GoalCandidate& each : choice.candidates)
    candidates.push_back(JsonObject()
                             .text("integrator", each.label)
                             .number("cost", each.cost)
                             .number("order", each.order)
                             .integer("runs", each.runs)
                             .str());
  return JsonObject()
      .number("allowed", choice.allowed)
      .number("size", choice.size)
      .json("of", of.empty() ? "null" : json_string(of))
      .text("integrator", choice.method->label)
      .number("dt", choice.dt)
      .number("tol", choice.tolerance)
      .number("error", choice.error)
      .number("largest", choice.largest)
      .flag("kept", choice.kept)
      .number("horizon", choice.horizon)
      .flag("chaotic", choice.chaotic)
      .number("cost", choice.cost)
      .number("over_cheapest", over_cheapest(choice))
      .number("cost_of_ten_times", choice.cost_of_ten)
      .number("trials", choice.trials)
      .number("check", choice.check)
      .integer("mended", choice.mended)
      .number("window", choice.window)
      .text("command", command)
      .json("candidates", json_array(candidates))
      .str();
}

study::RunDeviation goal_deviation(const GoalChoice& choice, const std::string& of) {
  study::RunDeviation deviation;
  if (!choice.kept || !of.empty()) return deviation;
  deviation.outcome = study::RunDeviation::Outcome::kCompared;
  deviation.rms = choice.error;
  deviation.error = deviation.at_end = choice.largest;
  deviation.share = choice.error / choice.size;
  deviation.allowed = choice.allowed / choice.size;
  return deviation;
}

void take_missed_pulse(const study::Track& track, GoalChoice& choice) {
  if (const double t = track.missed_pulse(); !std::isnan(t)) choice.miss_pulse(t);
}

}  // namespace sim::report
