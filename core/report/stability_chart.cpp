#include "core/report/stability_chart.h"

#include <cmath>

#include "core/base/text.h"
#include "core/output/svg.h"

namespace sim::report {

std::string chart_of(const study::Stability& study) {
  BarChart chart{.title = "Largest stable steps: " + study.system,
                 .x_name = "largest stable step [s]; the line is the step of the scene, " +
                           brief(study.dt) + " s",
                 .mark = study.dt};
  for (const study::MethodStability& each : study.methods) {
    const std::optional<double> limit = study::step_limit(each);
    if (study::has_own_steps(each.method) || !limit) continue;
    chart.bars.push_back({.name = each.method.label,
                          .words = *limit == 0          ? "no step is stable"
                                   : std::isinf(*limit) ? "every step is stable"
                                                        : brief(*limit, 3) + " s",
                          .value = *limit});
  }
  return svg(chart);
}

}  // namespace sim::report
