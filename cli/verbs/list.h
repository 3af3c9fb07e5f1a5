// `sim list`: the available scenes and plugins.
#pragma once

#include <string>

#include "cli/run/environment.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct ListRequest {
  std::string what;  // integrators, forces, ..., scenes; empty = all of them
  bool json = false;
  bool luacats = false;   // instead: types for editors
  bool names = false;     // names alone, one a line
  bool markdown = false;  // instead: the scene language and every plugin as a page
};

// One line a name with its aliases and summary; a plugin that cannot be opened says why. Throws
// Error{kUsage} for an unknown `what`.
int list(const ListRequest& request, const Environment& environment, Registry& registry,
         Console& console);

// "integrators, forces, ...": the kinds of plugins.
std::string plural_kinds();

}  // namespace sim::cli
