// The scene language and every plugin as a page of Markdown, from what they say of themselves.
#pragma once

#include <string>

#include "cli/run/environment.h"

namespace sim::cli {

// Plugins that cannot be opened are passed over.
std::string reference_page(const Environment& environment, Registry& registry);

}  // namespace sim::cli
