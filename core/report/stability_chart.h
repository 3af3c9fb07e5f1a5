// The largest stable step of every method, as .svg.
#pragma once

#include <string>

#include "core/study/limits/stability.h"

namespace sim::report {

std::string chart_of(const study::Stability& study);

}  // namespace sim::report
