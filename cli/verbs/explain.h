// `sim explain verdict`: the meaning of each clause of a verdict, and its measure.
#pragma once

#include <string>

namespace sim::cli {

// A page of text. Throws Error{kUsage} for an unknown topic.
std::string explanation(const std::string& what);

}  // namespace sim::cli
