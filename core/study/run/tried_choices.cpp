#include "core/study/run/tried_choices.h"

#include <utility>

#include "core/study/run/follow.h"
#include "core/study/run/run_length.h"

namespace sim::study {
namespace {

Verdict verdict_of(const Problem& problem, const WorkPrecision& study, Place place,
                   std::optional<double> time, const std::function<bool()>& stop) {
  const Point& point = study.at(place);
  RunOptions options = problem.options;
  options.integrator = study.curves[place.curve].method;
  if (point.tolerance > 0)
    options.integrator.given["tol"] = point.tolerance;
  else
    options.dt = point.dt;
  Simulation system(*problem.spec, *problem.registry, options);
  system.stop_when(stop);
  const RunLength length{time, {}};
  Track track(*problem.spec, system, steps_of(length, system), Track::kNever, Track::kNever,
              problem.registry);
  shorten(length, track);
  follow(track, stop);
  track.verify(stop);
  return track.verdict();
}

}  // namespace

Tried try_recommended(const Problem& problem, WorkPrecision& study, std::optional<double> time,
                      const std::function<bool()>& stop) {
  constexpr std::size_t kMostRuns = 12;
  Tried tried;
  while (study.recommended && !stop()) {
    const Place place = *study.recommended;
    Verdict verdict = verdict_of(problem, study, place, time, stop);
    if (stop()) break;
    if (verdict.trust < Trust::kSuspect) {
      tried.recommended = std::move(verdict);
      break;
    }
    study.refused.push_back(place);
    tried.refused.push_back(std::move(verdict));
    recommend(study);
    if (tried.refused.size() == kMostRuns) study.recommended = study.cheapest = {};
  }
  return tried;
}

}  // namespace sim::study
