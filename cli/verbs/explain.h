// `sim explain verdict`: what each clause of a verdict means, and by which measure.
#pragma once

#include <string>

namespace sim::cli {

// A page of text. Throws Error{kUsage} for what there is no page of.
std::string explanation(const std::string& what);

}  // namespace sim::cli
