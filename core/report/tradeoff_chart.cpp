#include "core/report/tradeoff_chart.h"

#include <algorithm>

#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/svg.h"

namespace sim::report {

// The methods with a point on the front are in colour, and theirs on it are filled.
std::string chart_of(const study::WorkPrecision& study) {
  Chart chart;
  const std::string in_unit = study.unit.empty() ? "" : " " + study.unit;
  chart.title = "Error against cost: " + study.system + " to t = " + brief(study.time) + " s";
  chart.subtitle =
      "in colour the methods that are cheapest for some accuracy, filled where they are";
  chart.x_name = "evaluations of f (implicit, single: what their time is worth)";
  chart.y_name = study.unit.empty() ? "rms error, the largest of all steps"
                                    : "rms error of positions [m], the largest of all steps";
  chart.lines.push_back({study.budget, "budget " + brief(study.budget, 2) + in_unit, true});
  chart.lines.push_back(
      {study.yardstick.reference ? study.yardstick.floor() : 0, "what the reference is known to"});
  for (std::size_t c = 0; c < study.curves.size(); ++c) {
    const study::Curve& curve = study.curves[c];
    ChartCurve& drawn = chart.curves.emplace_back();
    drawn.name = curve.method.label;
    drawn.strong = false;
    drawn.dashed = curve.method.info.implicit;
    for (std::size_t p = 0; p < curve.points.size(); ++p)
      if (study::stable(curve.points[p], study.size) &&
          curve.points[p].rms > study.yardstick.floor()) {
        drawn.points.emplace_back(curve.cost[p], curve.points[p].rms);
        drawn.filled.push_back(on_front(study, {c, p}));
        drawn.strong = drawn.strong || drawn.filled.back();
      }
    const int order = curve.method.info.order;
    if (drawn.strong && order > 0 && std::ranges::find(chart.orders, order) == chart.orders.end())
      chart.orders.push_back(order);
  }
  std::ranges::sort(chart.orders);
  if (study.recommended) {
    const study::Point& chosen = study.at(*study.recommended);
    chart.ring = ChartRing{study.cost(*study.recommended), chosen.rms,
                           "recommended: " + study.curves[study.recommended->curve].method.label +
                               (chosen.tolerance > 0 ? ", tol " + brief(chosen.tolerance, 3)
                                                     : ", " + brief(chosen.dt, 3) + " s")};
  }
  return svg(chart);
}

}  // namespace sim::report
