// The description of a plugin, for machines.
#pragma once

#include <string>

#include "core/report/integrator_facts.h"

namespace sim::report {

// Keys kind, name, aliases, summary, formula, source, params, arity, pointwise, free_numbers,
// example, file; of an integrator those of add_facts(), too.
JsonObject plugin_json(const PluginInfo& info, Registry& registry);

// The text that a scene writes: "sim.force.gravity { g = [0,-9.8,0] }".
std::string example_text(const PluginInfo& info);

}  // namespace sim::report
