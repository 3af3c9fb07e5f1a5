// Reports of the rest state of a scene, for people and for machines.
#pragma once

#include <functional>
#include <string>

#include "core/study/rest.h"

namespace sim::report {

// Brings a scene to rest: study::come_to_rest. Throws Error{kDiverged} if there is no rest state.
study::Rest rest_of(Simulation& system, const std::function<bool()>& stop);

// "at rest: the largest force left is ..", one line.
std::string rest_text(const study::Rest& rest);
std::string rest_json(const Simulation& system, const study::Rest& rest);

}  // namespace sim::report
