// The integrator of a run as text: NAME:PARAM=VALUE,...
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"

namespace sim::study {

// The text as a value of the declared type; one that does not fit stays a text, for Params to
// refuse.
Value value_of(const std::string& text, const Param& param);

// "NAME" or "NAME:PARAM=VALUE,PARAM=VALUE"; the values are texts. Throws Error{kUsage}.
MethodChoice parse_integrator(const std::string& text);

// Parses several of them, which were separated by commas; PARAM=VALUE without a name belongs to the
// one before.
std::vector<MethodChoice> parse_integrators(const std::vector<std::string>& words);

// The choice with its texts as values of the types that integrator `name` declares. Throws
// Error{kUsage}: unknown integrator or parameter, bad value, a tolerance for a method without one.
MethodChoice typed(const MethodChoice& choice, const std::string& name, Registry& registry);

}  // namespace sim::study
