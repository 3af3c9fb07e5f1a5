// The targets of ./dev fuzz: each takes bytes. Errors that are meant for users are no finding.
#pragma once

#include <string_view>

#include "cli/run/environment.h"
#include "core/plugin/registry.h"

namespace sim_fuzz {

void fuzz(std::string_view bytes);  // of each kind its own

// The plugins and scripts of the build, opened once; a folder that is thrown away is the present
// one.
const sim::cli::Environment& environment();
sim::Registry& registry();

}  // namespace sim_fuzz
