#include "cli/verbs/stability.h"

#include "cli/run/study_progress.h"
#include "cli/verbs/study.h"
#include "core/output/output.h"
#include "core/report/stability_chart.h"
#include "core/report/stability_report.h"

namespace sim::cli {
int stability(const StabilityRequest& request, const Environment& environment, Registry& registry,
              Console& console) {
  if (request.extremes) {  // a study of its own, by its older name
    StudyRequest study;
    study.study = "extremes";
    study.integrators = request.integrators;
    study.json = request.json;
    study.progress = request.progress;
    return cli::study(study, environment, registry, console);
  }
  const LoadedScene scene = load(request.scene, environment, registry);
  FilePlan plan;
  plan_inputs(scene.spec, registry, plan);
  plan_plot(request.svg, scene.spec, plan);
  plan.check();
  std::optional<Output> picture;
  if (request.svg) picture.emplace(Target{*request.svg, TableFormat::kSvg}, console.out);
  StudyProgress progress(request.progress, console);
  std::vector<std::string> texts;
  for (const SystemSpec& spec : scene.spec.systems) {
    if (progress.caught()) break;
    const study::Problem problem{&spec, &registry, run_options(request.scene, spec, registry)};
    const study::StabilityOptions options{
        .at = request.at,
        .integrators = study_choices(request.integrators, registry),
        .announce = [&](double seconds) { progress.announce(seconds); }};
    const study::Stability result = study::stability(problem, options, progress.watch());
    texts.push_back(request.json ? report::stability_json(result) : report::stability_text(result));
    if (picture) picture->buffer() += report::chart_of(result);
  }
  progress.clear();
  if (picture) picture->commit();
  put_studies(texts, request.json, scene.spec.world, console);
  return progress.exit_code();
}

}  // namespace sim::cli
