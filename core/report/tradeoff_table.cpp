#include "core/report/tradeoff_table.h"

#include <cmath>

#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/tradeoff_report.h"

namespace sim::report {

TradeoffTable::TradeoffTable(const Target& target, std::ostream& standard_output)
    : output_(target, standard_output), format_(target.format) {
  if (format_ == TableFormat::kCsv)
    output_.buffer() +=
        "system,integrator,order,dt,tol,status,error,relative,error_end,max_end,worst,energy,"
        "steps,evaluations,newton,factorisations,linear,cost,seconds,spread,front\n";
}

void TradeoffTable::add(const study::WorkPrecision& study) {
  for (std::size_t c = 0; c < study.curves.size(); ++c)
    for (std::size_t p = 0; p < study.curves[c].points.size(); ++p) row(study, {c, p});
}

void TradeoffTable::row(const study::WorkPrecision& study, study::Place place) {
  const study::Curve& curve = study.curves[place.curve];
  const study::Point& point = study.at(place);
  std::string& out = output_.buffer();
  if (format_ == TableFormat::kJsonLines) {
    const std::string rest = point_json(study, place).str();
    out += JsonObject()
               .text("system", study.system)
               .text("integrator", curve.method.label)
               .integer("order", curve.method.info.order)
               .str();
    out.back() = ',';
    out.append(rest, 1) += '\n';
    return;
  }
  out += csv_field(study.system) + ',' + csv_field(curve.method.label) + ',' +
         std::to_string(curve.method.info.order);
  const auto number = [&](double value) {
    out += ',';
    if (std::isfinite(value)) append_number(out, value);
  };
  const double unknown = point.finished ? 0 : std::nan("");
  number(point.dt);
  number(point.tolerance);
  out += std::string(",") + point_status(study, point);
  for (const double value : {point.rms, point.rms / study.size, point.rms_end, point.most_end})
    number(value + unknown);
  for (const double value : {static_cast<double>(point.worst), point.energy}) number(value);
  for (const std::int64_t count : {point.steps, point.effort.evaluations, point.effort.newton,
                                   point.effort.factorisations, point.effort.linear})
    out += ',' + std::to_string(count);
  for (const double value : {study.cost(place), point.seconds, point.spread}) number(value);
  out += on_front(study, place) ? ",1\n" : ",0\n";
}

}  // namespace sim::report
