#include "core/report/rest_report.h"

#include "core/base/error.h"
#include "core/output/format.h"

namespace sim::report {

study::Rest rest_of(Simulation& system, const std::function<bool()>& stop) {
  const study::Rest rest = study::come_to_rest(system, stop);
  if (!rest.found)
    throw Error(
        ErrorKind::kDiverged,
        {"no rest was found", system.name(),
         rest.why + "; the largest force left is " + brief(rest.force, 3) + " N", rest.remedy});
  return rest;
}

std::string rest_json(const Simulation& system, const study::Rest& rest) {
  return JsonObject()
      .text("system", system.name())
      .number("force", rest.force)
      .number("in_play", rest.in_play)
      .number("potential", rest.potential)
      .integer("steps", rest.effort.steps)
      .integer("newton", rest.effort.newton)
      .integer("broke", rest.broke)
      .str();
}

std::string rest_text(const study::Rest& rest) {
  return "at rest: the largest force left is " + brief(rest.force, 3) + " N of " +
         brief(rest.in_play, 3) + " N in play; potential energy " + brief(rest.potential, 10) +
         " J; " + std::to_string(rest.effort.steps) + " steps" +
         (rest.effort.newton > 0 ? ", " + std::to_string(rest.effort.newton) + " of Newton's method"
                                 : std::string()) +
         (rest.broke > 0 ? "; " + std::to_string(rest.broke) + " springs or rods broke on the way"
                         : std::string()) +
         (rest.at_this_time ? "; forces depend on time: this is for t = " + brief(rest.t) + " s"
                            : std::string());
}

}  // namespace sim::report
