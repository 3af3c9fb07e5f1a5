// The machine form of a run's report: one JSON object.
#pragma once

#include <span>
#include <string>

#include "core/study/run/track.h"
#include "core/study/study.h"

namespace sim::report {

// {"scene","systems":[...],"threads","seconds","verdict","reason"} with, for each system,
//   {"name","order_of_state","particles","pinned","springs":{FAMILY:n},"integrator","dt",
//    "steps","t","last_step","began_anew","integrator_params":{NAME:text},
//    "effort":{"steps","rejected","evaluations"},
//    "energy":{"start","end","work","drift"},"error","hash","verdict","reason",
//    "figures":{"energy","dt_share","dt_share_at_most","strain","step_error","momentum","verified",
//               "position_error","position_share","horizon","neighbours"},"postmortem"}
// Springs and energy for second-order systems, error where the scene has an exact solution,
// components instead of particles for a flat state; figures as in study::Figures, null where not
// known or without bounds; began_anew: a method that keeps earlier steps, for a last_step that is
// shorter than dt. dt, last_step, t and seconds in s, energies in J.
// `choices`, one a system or none at all: what --error chose becomes "error_goal" of its system.
// `post_mortems`, one a system or none at all: what is not empty becomes "postmortem" of its
// system, and the first of them that of the whole.
std::string summary_json(const StudiedScene& scene, std::span<study::Track> tracks, double seconds,
                         std::span<const std::string> post_mortems = {},
                         std::span<const std::string> choices = {});

// One of the "figures" above by its name, 0 or 1 for a flag. Throws Error{kUsage} for another name.
double figure_named(const study::Figures& figures, const std::string& name);

// Springs of all families.
long spring_count(const Simulation& system);

// All particles and springs of a scene.
struct SceneCounts {
  long particles = 0, springs = 0;

  std::string json(const std::string& file) const;  // with the file that holds them
};
SceneCounts counts_of(const StudiedScene& scene);

// The state hash as 16 hexadecimal digits.
std::string hash_text(const Simulation& system);

}  // namespace sim::report
