// The report that is printed when a run diverged: the first spring to fail, and settings that work
// instead.
#pragma once

#include <string>

#include "cli/run/scene.h"
#include "core/study/verdict/postmortem.h"

namespace sim::cli {

// A few lines for people; `request` as the run was asked for, so that what is said can be run.
std::string post_mortem_text(const study::PostMortem& result, const std::string& system,
                             const SceneRequest& request);

// {"integrator","dt","dt_share","step",
//  "spring":{"a","b","family","strain","since","t","growth"},"particle",
//  "forces":[{"name","force"}],"smaller":{"integrator","dt","steps","verdict"},"other":{...}}
std::string post_mortem_json(const study::PostMortem& result);

}  // namespace sim::cli
