// The integrator of a run as given on the command line: -i NAME:PARAM=VALUE,..., --tol,
// --precision, --fixed-step.
#pragma once

#include <string>
#include <vector>

#include "core/study/method_text.h"

namespace sim::cli {

using study::parse_integrator, study::typed, study::value_of;

// Several integrators between commas; PARAM=VALUE without a name belongs to the one before.
std::vector<MethodChoice> parse_integrators(const std::string& option, const std::string& text);

// Gives the choice the values of --tol (a number > 0), --precision and --fixed-step; empty texts
// and false give none. Throws Error{kUsage} for a bad tolerance or a value that is there already.
void add_options(MethodChoice& choice, const std::string& tol, const std::string& precision,
                 bool fixed_step);

}  // namespace sim::cli
