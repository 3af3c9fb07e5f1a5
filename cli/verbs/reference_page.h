// The scene language and every plugin as a page of Markdown, from their declarations.
#pragma once

#include <string>

#include "cli/run/environment.h"

namespace sim::cli {

// Plugins that cannot be opened are skipped.
std::string reference_page(const Environment& environment, Registry& registry);

}  // namespace sim::cli
