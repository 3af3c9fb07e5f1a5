// The results of a study of the order of convergence, for people and for machines.
#pragma once

#include <string>

#include "core/study/accuracy/order.h"

namespace sim::report {

// `of`: the judged quantity, as study::Quantity; empty: positions.
std::string order_text(const study::OrderStudy& result, const std::string& of);
std::string order_json(const study::OrderStudy& result, const std::string& of);

}  // namespace sim::report
