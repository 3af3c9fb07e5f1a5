// The results of a study of stability, for people and for machines.
#pragma once

#include <string>

#include "core/study/limits/stability.h"

namespace sim::report {

std::string stability_text(const study::Stability& result);
std::string stability_json(const study::Stability& result);  // see `sim stability --help`

}  // namespace sim::report
