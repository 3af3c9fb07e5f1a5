// The judged run of the laboratory, by the names that the verbs use.
#pragma once

#include "core/report/check.h"
#include "core/report/summary.h"
#include "core/study/run/follow.h"
#include "core/study/run/run_length.h"
#include "core/study/run/track.h"

namespace sim::cli {

using report::Checks, report::check, report::parse_checks;
using report::hash_text, report::summary_json;
using study::follow, study::furthest_behind, study::overall_verdict, study::RunLength,
    study::shorten, study::steps_of;
using study::kMostSteps, study::Track, study::Trust, study::Verdict;

}  // namespace sim::cli
