// The results of a study of speed against accuracy, for people and for machines.
#pragma once

#include <optional>
#include <string>

#include "core/output/format.h"
#include "core/study/accuracy/work_precision.h"
#include "core/study/run/tried_choices.h"

namespace sim::report {

// The request, for the commands that it prints.
struct TradeoffAsked {
  std::string command;         // "sim SCENE -s n=3", without method and step
  std::string of;              // as study::Quantity; empty: positions
  std::optional<double> time;  // s
};

std::string tradeoff_text(const study::WorkPrecision& study, const TradeoffAsked& asked,
                          const study::Tried& tried);
// One JSON object: what `sim tradeoff --help` says.
std::string tradeoff_json(const study::WorkPrecision& study, const TradeoffAsked& asked,
                          const study::Tried& tried);

// One point of a method, as an element of `points`.
JsonObject point_json(const study::WorkPrecision& study, study::Place place);
const char* point_status(const study::WorkPrecision& study, const study::Point& point);

}  // namespace sim::report
