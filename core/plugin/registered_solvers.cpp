#include "core/plugin/registered_solvers.h"

#include "core/plugin/plugin_info.h"
#include "core/plugin/registry.h"

namespace sim {

MakeImplicitSolvers registered_solvers(Registry& registry) {
  return [&registry](ParticleSystem& system) {
    const auto& plugin = registry.get<ImplicitSolvers>("particles");
    return made(plugin.make(Params(plugin.title(), plugin.params, {}, {}), system), plugin);
  };
}

}  // namespace sim
