#include "core/report/stability_report.h"

#include <cmath>
#include <numbers>

#include "core/math/elementary.h"
#include "core/output/format.h"
#include "core/report/study_words.h"

namespace sim::report {
namespace {

using study::MethodStability;
using study::Stability;

constexpr std::size_t kStep = 10, kOff = 7, kDt = 9, kEnergy = 8;
constexpr std::size_t kMostName = 20;  // of a name that its row stands beside
constexpr std::size_t kShownRun = 1;   // the first of the runs at shares of the limit that is shown

std::string step_text(const std::optional<double>& step) {
  if (!step) return "-";
  if (*step == 0) return "none";
  return std::isinf(*step) ? "any" : brief(*step, 4);
}

std::string limit_name(const MethodStability& each) {
  if (study::has_own_steps(each.method)) return "own steps";
  const std::optional<double> limit = study::step_limit(each);
  if (!limit) return "unknown";
  return *limit == 0 ? "none stable" : std::isinf(*limit) ? "unlimited" : "step";
}

// At most six characters, so that the columns stay apart.
std::string off_text(const MethodStability& each) {
  if (!each.predicted || !each.measured || *each.predicted == 0) return "";
  const double off = 100 * (*each.measured / *each.predicted - 1);
  if (!std::isfinite(off)) return "";
  if (std::abs(off) < 0.05) return "0 %";
  if (const double ratio = *each.measured / *each.predicted; off >= 999)
    return "x" + brief(ratio, ratio < 99.5 ? 2 : ratio < 999.5 ? 3 : 1);
  return percent(std::round(10 * off) / 10, 100, 2);
}

// The distance of a step dt from the limit, or its growth beyond the limit.
std::string standing(const MethodStability& each, double dt) {
  if (study::has_own_steps(each.method)) return "own steps";
  const std::optional<double> limit = study::step_limit(each);
  const bool inside = limit && dt < *limit;  // then the system itself grows
  if (each.radius && *each.radius > 1 + 1e-3 && !inside)
    return std::isinf(*each.radius) ? "fails" : "x" + brief(*each.radius, 3);
  if (!limit) return "-";
  if (*limit == 0) return "grows";
  return std::isinf(*limit) ? "stable" : percent(dt / *limit, 1, 2);
}

std::string energy_text(const study::EnergyAtStep& point) {
  return std::isinf(point.error) ? "fails" : brief(point.error, 2);
}

std::string place_text(const Stability& result) {
  std::vector<std::string> particles, families;
  for (const auto& [particle, share] : result.spectrum.particles)
    particles.push_back(std::to_string(particle));
  for (const auto& [family, share] : result.spectrum.families)
    families.push_back(family + " " + percent(share, 1, 2));
  return "mostly at particles " + join(particles, " ") + (families.empty() ? "" : "; ") +
         join(families, ", ");
}

// Methods that no step makes stable, and how fast they are wrong at the present one.
std::string hopeless_text(const Stability& result) {
  std::string text;
  for (const MethodStability& each : result.methods) {
    if (limit_name(each) != "none stable") continue;
    text += wrapped(each.method.label +
                        " has no stable step here: it lets the fastest modes grow at every "
                        "step size",
                    2);
    if (each.radius && *each.radius > 1)
      text += "\n  at " + brief(result.dt) + " s the fastest mode grows e times every " +
              brief(result.dt / elementary::log(*each.radius), 3) + " s";
    text += '\n';
  }
  return text;
}

// Methods whose runs at shares of the limit were left out.
std::string late_text(const Stability& result) {
  std::vector<std::string> late;
  for (const MethodStability& each : result.methods)
    if (each.late) late.push_back(each.method.label);
  if (late.empty()) return "";
  return wrapped("Not all runs were made of " + join(late, ", ") +
                     ": the study took far longer than estimated; --integrators chooses some",
                 2) +
         '\n';
}

std::string table_text(const Stability& result) {
  std::size_t width = 11;
  for (const MethodStability& each : result.methods)
    width = std::max(width, each.method.label.size() + 1);
  width = std::min(width, kMostName);
  std::string text = left("", width) + right("largest stable step [s]", 2 * kStep + 4);
  if (result.energy_time > 0)
    text += right("", kOff + kDt - 4) +
            (result.spectrum.first_order ? "  error at share of it" : "  energy error at share");
  text += '\n';
  text += left("integrator", width) + right("predicted", kStep) + right("measured", kStep) +
          right("off", kOff) + right("your dt", kDt);
  if (result.energy_time > 0)
    for (const char* share : {"0.5", "0.9", "1.1"}) text += right(share, kEnergy);
  text += '\n';
  for (const MethodStability& each : result.methods) {
    std::string line = first_cell(each.method.label, width) +
                       right(step_text(each.predicted), kStep) +
                       right(step_text(each.measured), kStep) + right(off_text(each), kOff) +
                       right(standing(each, result.dt), kDt);
    for (std::size_t i = kShownRun; i < each.energy.size(); ++i)
      line += right(energy_text(each.energy[i]), kEnergy);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

// "192.7 rad/s (period 0.0326 s), damping 2 /s", or "decay of 90 1/s" of a first-order system.
std::string fastest_text(const study::Spectrum& spectrum) {
  constexpr double kTurns = 1.9;  // |damping| over |lambda| above which nothing oscillates to see
  const study::Vibration& fastest = spectrum.fastest;
  if (fastest.omega == 0) return "nothing vibrates, decays or grows";
  if (spectrum.first_order && std::abs(fastest.damping) > kTurns * fastest.omega)
    return (fastest.damping > 0 ? "decay of " : "growth of ") + brief(fastest.omega) + " 1/s";
  std::string text = brief(fastest.omega) + " rad/s (period " +
                     brief(2 * std::numbers::pi / fastest.omega, 3) + " s), ";
  if (spectrum.first_order) {
    const double rate = -fastest.damping / 2;
    if (std::abs(rate) < 1e-6 * fastest.omega) return text + "neither growing nor decaying";
    return text + (rate > 0 ? "growing at " : "decaying at ") + brief(std::abs(rate), 3) + " 1/s";
  }
  text += "damping " + brief(fastest.damping) + " /s";
  if (spectrum.decay > fastest.omega)
    text += "; fastest decay " + brief(spectrum.decay, 4) + " 1/s";
  return text;
}

std::string limit_json(const MethodStability& each) {
  JsonObject object;
  object.text("name", each.method.label).integer("order", each.method.info.order);
  object.number("predicted_dt", each.predicted.value_or(std::nan("")))
      .number("measured_dt", each.measured.value_or(std::nan("")))
      .text("limit", limit_name(each))
      .number("radius", each.radius.value_or(std::nan("")));
  std::vector<std::string> energy;
  for (const auto& point : each.energy)
    energy.push_back(JsonObject()
                         .number("fraction", point.fraction)
                         .number("dt", point.dt)
                         .number("error", point.error)
                         .str());
  return object.json("energy", json_array(energy)).flag("late", each.late).str();
}

}  // namespace

std::string stability_text(const Stability& result) {
  const study::Spectrum& spectrum = result.spectrum;
  std::string text = label("system", result.system + ", at t = " + brief(result.t) + " s");
  text += label("fastest",
                wrapped(fastest_text(spectrum) + "; residual " + brief(spectrum.residual, 2) +
                            " after " + std::to_string(spectrum.products) + " products",
                        12, 12));
  const double omega = spectrum.fastest.omega;
  if (std::isfinite(spectrum.bound))
    text += label("bound", brief(spectrum.bound) + " rad/s, from masses and stiffnesses alone");
  if (!spectrum.particles.empty()) text += label("where", wrapped(place_text(result), 12, 12));
  if (spectrum.growth > 1e-4 * omega && !spectrum.first_order)
    text += label("buckling", "some direction grows at " + brief(spectrum.growth, 3) +
                                  " /s by itself, whatever the step");
  text += label("your run", result.integrator + ", dt " + brief(result.dt) + " s");
  text += '\n' + table_text(result);
  if (spectrum.first_order)
    text += "The limits are those of the system made linear at this state; runs of " +
            brief(result.energy_time, 4) +
            " s\nat shares of them show what the system itself does: the error, over its largest\n"
            "number, against steps of a tenth.\n";
  else if (result.energy_time > 0)
    text += "Energy error: of runs of " + brief(result.energy_time, 4) +
            " s, the largest, of the energy in play.\n"
            "Limits are those of the system made linear at this state.\n";
  if (std::ranges::any_of(result.methods, [](const MethodStability& each) {
        return each.method.info.implicit && each.method.info.needs_second_order;
      }))
    text +=
        "The limit of a method that is implicit in stiff forces alone is that of the\n"
        "rest, as your step divides them; a run with another step divides them anew.\n";
  return text + late_text(result) + hopeless_text(result);
}

std::string stability_json(const Stability& result) {
  std::vector<std::string> particles, families, methods;
  for (const auto& [particle, share] : result.spectrum.particles)
    particles.push_back(JsonObject().integer("particle", particle).number("share", share).str());
  for (const auto& [family, share] : result.spectrum.families)
    families.push_back(JsonObject().text("family", family).number("share", share).str());
  for (const MethodStability& each : result.methods) methods.push_back(limit_json(each));
  return JsonObject()
      .text("system", result.system)
      .number("t", result.t)
      .number("omega_max", result.spectrum.fastest.omega)
      .number("damping", result.spectrum.fastest.damping)
      .number("residual", result.spectrum.residual)
      .number("bound", result.spectrum.bound)
      .number("growth", result.spectrum.growth)
      .number("decay", result.spectrum.decay)
      .json("particles", json_array(particles))
      .json("families", json_array(families))
      .text("integrator", result.integrator)
      .number("dt", result.dt)
      .number("energy_time", result.energy_time)
      .flag("complete", result.complete)
      .json("integrators", json_array(methods))
      .str();
}

}  // namespace sim::report
