#include "core/plugin/plugin.h"

#include "core/particles/contact_task.h"
#include "core/particles/implicit_solvers.h"

namespace sim {

template void Registrar::add(Plugin<Integrator>);
template void Registrar::add(Plugin<Force>);
template void Registrar::add(Plugin<Field>);
template void Registrar::add(Plugin<Collider>);
template void Registrar::add(Plugin<RigidMotion>);
template void Registrar::add(Plugin<ContactLaw>);
template void Registrar::add(Plugin<Constraint>);
template void Registrar::add(Plugin<StepCorrection>);
template void Registrar::add(Plugin<ImplicitSolvers>);

std::string PluginInfo::title() const { return std::string(kind.name) + " '" + name + "'"; }

}  // namespace sim
