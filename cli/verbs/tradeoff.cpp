#include "cli/verbs/tradeoff.h"

#include <algorithm>
#include <cmath>

#include "cli/run/study_progress.h"
#include "cli/verbs/tradeoff_chart.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/tradeoff_report.h"

namespace sim::cli {
namespace {

using report::point_json, report::point_status;
using study::Curve, study::Point, study::WorkPrecision;
using PlaceOf = study::Place;

// Every point of every method.
class PointTable {
 public:
  PointTable(const Target& target, Console& console)
      : output_(target, console.out), format_(target.format) {
    if (format_ == TableFormat::kCsv)
      output_.buffer() +=
          "system,integrator,order,dt,tol,status,error,relative,error_end,max_end,worst,energy,"
          "steps,evaluations,newton,factorisations,linear,cost,seconds,spread,front\n";
  }

  void add(const WorkPrecision& study) {
    for (std::size_t c = 0; c < study.curves.size(); ++c)
      for (std::size_t p = 0; p < study.curves[c].points.size(); ++p) row(study, {c, p});
  }

  void commit() { output_.commit(); }

 private:
  void row(const WorkPrecision& study, PlaceOf place) {
    const Curve& curve = study.curves[place.curve];
    const Point& point = study.at(place);
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

  Output output_;
  TableFormat format_;
};

}  // namespace

int tradeoff(const TradeoffRequest& request, const Environment& environment, Registry& registry,
             Console& console) {
  const LoadedScene scene = load(request.scene, environment, registry);
  FilePlan plan;
  plan_inputs(scene.spec, registry, plan);
  if (request.csv) plan.writes("--csv", request.csv->file);
  plan_plot(request.svg, scene.spec, plan);
  plan.check();
  std::optional<PointTable> table;
  if (request.csv) table.emplace(*request.csv, console);
  std::optional<Output> picture;
  if (request.svg) picture.emplace(Target{*request.svg, TableFormat::kCsv}, console.out);

  StudyProgress progress(request.progress, console);
  const report::TradeoffAsked asked{command_for(request.scene), request.of, request.time};
  std::vector<std::string> texts;
  for (const SystemSpec& spec : scene.spec.systems) {
    if (progress.caught()) break;
    study::WorkPrecisionOptions options;
    options.time = request.time.value_or(0);
    options.budget = request.budget.value;
    options.budget_in_metres = request.budget.in_metres;
    options.integrators = study_choices(request.integrators, registry);
    study::Problem problem{&spec, &registry, run_options(request.scene, spec, registry)};
    problem.of = quantity(spec, request.of);
    progress.announce(study::expected(problem, options));
    const auto study = study::work_precision(problem, options, progress.watch());
    const study::Tried tried = study::try_recommended(problem, *study, request.time,
                                                      [&] { return progress.caught() != 0; });
    texts.push_back(request.json ? report::tradeoff_json(*study, asked, tried)
                                 : report::tradeoff_text(*study, asked, tried));
    if (table) table->add(*study);
    if (picture) picture->buffer() += chart_of(*study);
  }
  progress.clear();
  if (table) table->commit();
  if (picture) picture->commit();
  const bool taken = request.csv && request.csv->standard_output();
  if (!taken) put_studies(texts, request.json, scene.spec.world, console);
  return progress.exit_code();
}

}  // namespace sim::cli
