// Error against cost of every method, as .svg.
#pragma once

#include <string>

#include "core/study/accuracy/work_precision.h"

namespace sim::report {

std::string chart_of(const study::WorkPrecision& study);

}  // namespace sim::report
