#include "core/session/side_by_side.h"

#include <vector>

#include "core/fields/field_system.h"
#include "core/fields/pair_field.h"
#include "core/scene/simulation.h"

namespace sim {
namespace {

const PairField* stepping_field(const Simulation& run) {
  const IntegratorInfo info = run.integrator_info();
  if (info.adaptive || info.implicit) return nullptr;
  const auto* const system = dynamic_cast<const FieldSystem*>(&run.ode());
  return system ? dynamic_cast<const PairField*>(&system->field()) : nullptr;
}

}  // namespace

bool may_step_side_by_side(const Simulation& run) {
  const PairField* const field = stepping_field(run);
  return field && field->may_step_side_by_side();
}

bool step_side_by_side(std::span<Simulation* const> runs) {
  std::vector<PairField::Run> fields;
  for (const Simulation* const run : runs) {
    const PairField* const field = stepping_field(*run);
    if (!field || run->step_count() != 0) return false;
    fields.push_back({field, dynamic_cast<const FieldSystem&>(run->ode()).start(), run->h()});
  }
  return fields.size() > 1 && fields.front().field->step_side_by_side(fields);
}

}  // namespace sim
