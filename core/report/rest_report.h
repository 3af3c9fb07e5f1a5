// Reports of the rest state of a scene, for people and for machines.
#pragma once

#include <functional>
#include <string>

#include "core/study/rest.h"

namespace sim::report {

// Brings it there: study::come_to_rest. Throws Error{kDiverged} where there is no rest.
study::Rest rest_of(Simulation& system, const std::function<bool()>& stop);

// "at rest: the largest force left is ..", one line.
std::string rest_text(const study::Rest& rest);
std::string rest_json(const Simulation& system, const study::Rest& rest);

}  // namespace sim::report
