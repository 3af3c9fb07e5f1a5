// --check verified,energy=1%,strain=20%,dt=90%: bounds on a run, with exit code 8 if one is
// violated.
#pragma once

#include <optional>
#include <string>

#include "core/study/verdict/verdict.h"

namespace sim::report {

// Limits as fractions (0.01 is 1 %) of the energy in play, of a rest length and of the largest
// stable step.
struct Checks {
  std::optional<double> energy, strain, dt;
  bool verified = false;  // the run is to be trusted
};

// Throws Error{kUsage} naming `option`.
Checks parse_checks(const std::string& option, const std::string& text);

// Throws Error{kCheck} for the first violated bound, or one that cannot be checked.
void check(const Checks& checks, const study::Verdict& verdict, const std::string& system);

}  // namespace sim::report
