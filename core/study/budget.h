// The allowed size of an error or of a change.
#pragma once

#include <string>

namespace sim::study {

// A relative budget, as a share of the size of a scene or of the range of a quantity; or an amount,
// in m or as a number.
struct Budget {
  double value = 1e-3;
  bool in_metres = false;

  double of(double range) const { return in_metres ? value : value * range; }
};

// "1%", "1 mm", "1e-3 m", "1e-3". Throws Error{kUsage} that names the option.
Budget parse_budget(const std::string& option, const std::string& text);

}  // namespace sim::study
