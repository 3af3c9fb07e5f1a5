// The properties by which a user compares integrators, from the methods themselves.
#pragma once

#include <optional>
#include <string>

#include "core/output/format.h"
#include "core/plugin/registry.h"

namespace sim::report {

struct IntegratorFacts {
  IntegratorInfo info;
  // The largest stable h omega of an undamped oscillation and h lambda of a decay e^(-lambda t): 0
  // = no step is stable, infinity = all are, not a number = the method does not know.
  double oscillation_limit = 0, decay_limit = 0;
};

// The facts for default parameters; empty if the plugin requires some to be given.
std::optional<IntegratorFacts> integrator_facts(const PluginInfo& info, Registry& registry);

// Keys order, evaluations, adaptive, symplectic, implicit, needs_second_order, oscillation_limit
// and decay_limit; a limit that is infinite or not known is null.
void add_facts(JsonObject& object, const IntegratorFacts& facts);

// "2.828", "any", "none", "?".
std::string limit_text(double limit);

// "symplectic, particles", "adaptive", "implicit, adaptive", "implicit", "explicit", "chooses among
// these".
std::string kind_text(const IntegratorInfo& info);

}  // namespace sim::report
