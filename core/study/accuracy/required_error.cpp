#include "core/study/accuracy/required_error.h"

#include <algorithm>
#include <array>

namespace sim::study {
namespace {

bool has_tolerance(const MethodChoice& method) {
  return std::ranges::any_of(std::array{"tol", "rtol", "atol"},
                             [&](const char* name) { return method.given.contains(name); });
}

}  // namespace

bool chooses_among_others(const MethodChoice& method, Registry& registry) {
  return !method.name.empty() && registry.get<Integrator>(method.name).make_from_others != nullptr;
}

std::optional<RequiredError> required_error(const SystemSpec& spec, const MethodChoice& named,
                                            double dt, Registry& registry) {
  if (has_tolerance(named)) return {};
  if (spec.error) return RequiredError{{spec.error->value, spec.error->in_metres}};
  const MethodChoice method = named.over(spec.integrator);
  const bool stepped = dt > 0 || (named.name.empty() && spec.dt > 0);
  if (stepped || has_tolerance(method) || !chooses_among_others(method, registry)) return {};
  return RequiredError{{}, false};
}

}  // namespace sim::study
