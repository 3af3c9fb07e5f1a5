// Trials of a study's choices, run as a user would run them.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/study/accuracy/work_precision.h"
#include "core/study/verdict/verdict.h"

namespace sim::study {

// Verdicts on runs of choices within the budget: on the recommended one, and on those of
// WorkPrecision::refused.
struct Tried {
  std::optional<Verdict> recommended;
  std::vector<Verdict> refused;
};

// Runs and verifies the recommendation, to `time` (s) or the scene's end. If it is suspect or
// diverges, it is refused, with all longer steps of its method; then the next is the
// recommendation, and there is none if all within the budget, or twelve, are refused.
Tried try_recommended(const Problem& problem, WorkPrecision& study, std::optional<double> time,
                      const std::function<bool()>& stop);

}  // namespace sim::study
