#include "core/study/run/divergence_text.h"

#include "core/base/text.h"
#include "core/study/verdict/bad_force.h"

namespace sim::study {

std::string step_place(std::int64_t step, double t, double h) {
  return "step " + std::to_string(step) + ", t = " + brief(t) + " s, h = " + brief(h) + " s";
}

std::string divergence_text(const SystemSpec& spec, Simulation& system) {
  const Divergence& where = system.divergence();
  if (where.status == StepStatus::kNotAllowed) {
    return where.why + " in " + step_place(where.step, where.t, where.h);
  }
  if (where.status != StepStatus::kNotFinite) {
    return std::string(where.status == StepStatus::kStepTooSmall
                           ? "no step is small enough for the tolerance in "
                           : "the equations of an implicit step have no solution in reach in ") +
           step_place(where.step, where.t, where.h);
  }
  std::string text = (where.item == "point" ? "particle" : where.item) + " " +
                     std::to_string(where.particle) +
                     (system.flat() ? "" : " (" + where.quantity + ")") + " is not finite after " +
                     step_place(where.step, where.t, where.h);
  if (const auto bad = find_bad_force(spec, system))
    text += ": force '" + bad->name + "'" + (bad->place.empty() ? "" : " (" + bad->place + ")") +
            " on particle " + std::to_string(bad->particle) + " is not finite there";
  return text;
}

}  // namespace sim::study
