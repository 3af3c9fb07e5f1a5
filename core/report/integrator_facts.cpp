#include "core/report/integrator_facts.h"

#include <cmath>

#include "core/ode/stability.h"

namespace sim::report {

std::optional<IntegratorFacts> integrator_facts(const PluginInfo& info, Registry& registry) {
  if (info.kind != kind_of<Integrator>) return {};
  for (const Param& param : info.params)
    if (param.required) return {};
  const auto method = Method(registry, info.name).make();
  return IntegratorFacts{method->info(), stable_step(*method, 1, 0), stable_step(*method, 0, 1)};
}

void add_facts(JsonObject& object, const IntegratorFacts& facts) {
  object.integer("order", facts.info.order)
      .integer("evaluations", facts.info.evaluations)
      .flag("adaptive", facts.info.adaptive)
      .flag("symplectic", facts.info.symplectic)
      .flag("implicit", facts.info.implicit)
      .flag("needs_second_order", facts.info.needs_second_order)
      .number("oscillation_limit", facts.oscillation_limit)
      .number("decay_limit", facts.decay_limit);
}

std::string limit_text(double limit) {
  if (std::isnan(limit)) return "?";
  if (std::isinf(limit)) return "any";
  return limit == 0 ? "none" : brief(limit, 4);
}

std::string kind_text(const IntegratorInfo& info) {
  if (info.order == 0) return "chooses among these";
  std::string text = info.implicit ? "implicit" : info.symplectic ? "symplectic" : "explicit";
  if (info.implicit && info.symplectic) text += ", symplectic";
  if (info.adaptive) text = info.implicit ? "implicit, adaptive" : "adaptive";
  if (info.needs_second_order) text += ", particles";
  return text;
}

}  // namespace sim::report
