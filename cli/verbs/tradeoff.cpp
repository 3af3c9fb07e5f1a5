#include "cli/verbs/tradeoff.h"

#include "cli/run/study_progress.h"
#include "core/report/tradeoff_chart.h"
#include "core/report/tradeoff_report.h"
#include "core/report/tradeoff_table.h"

namespace sim::cli {
int tradeoff(const TradeoffRequest& request, const Environment& environment, Registry& registry,
             Console& console) {
  const LoadedScene scene = load(request.scene, environment, registry);
  FilePlan plan;
  plan_inputs(scene.spec, registry, plan);
  if (request.csv) plan.writes("--csv", request.csv->file);
  plan_plot(request.svg, scene.spec, plan);
  plan.check();
  std::optional<report::TradeoffTable> table;
  if (request.csv) table.emplace(*request.csv, console.out);
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
    if (picture) picture->buffer() += report::chart_of(*study);
  }
  progress.clear();
  if (table) table->commit();
  if (picture) picture->commit();
  const bool taken = request.csv && request.csv->standard_output();
  if (!taken) put_studies(texts, request.json, scene.spec.world, console);
  return progress.exit_code();
}

}  // namespace sim::cli
