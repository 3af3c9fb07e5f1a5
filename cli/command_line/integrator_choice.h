// The integrator of a run as the command line says it: -i NAME:PARAM=VALUE,..., --tol,
// --precision, --fixed-step.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"

namespace sim::cli {

// The text as the declared type says; one that does not fit stays a text, for Params to refuse.
Value value_of(const std::string& text, const Param& param);

// "NAME" or "NAME:PARAM=VALUE,PARAM=VALUE"; the values are texts. Throws Error{kUsage}.
MethodChoice parse_integrator(const std::string& text);

// Several of them between commas; PARAM=VALUE without a name belongs to the one before.
std::vector<MethodChoice> parse_integrators(const std::string& option, const std::string& text);

// Gives the choice the values of --tol (a number > 0), --precision and --fixed-step; empty texts
// and false give none. Throws Error{kUsage} for a bad tolerance or a value that is there already.
void add_options(MethodChoice& choice, const std::string& tol, const std::string& precision,
                 bool fixed_step);

// The choice with its texts as values of the types that integrator `name` declares. Throws
// Error{kUsage}: unknown integrator or parameter, bad value, a tolerance where none is used.
MethodChoice typed(const MethodChoice& choice, const std::string& name, Registry& registry);

}  // namespace sim::cli
