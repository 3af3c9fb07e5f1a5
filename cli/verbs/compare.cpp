#include "cli/verbs/compare.h"

#include "cli/run/run_files.h"
#include "cli/run/study_progress.h"
#include "core/base/error.h"

namespace sim::cli {

int compare(const CompareRequest& request, const Environment& environment, Registry& registry,
            Console& console) {
  check_files(request.out, registry);
  const LoadedScene scene = load(request.scene, environment, registry);
  if (scene.spec.world)
    throw Error(ErrorKind::kUsage, {"several systems", request.scene.scene, "it is a world",
                                    "name the file of one of its scenes"});
  FilePlan plan;
  plan_inputs(scene.spec, registry, plan);
  plan_outputs(request.out, {}, plan);
  plan.check();
  StudyProgress progress(request.progress, console);
  const SystemSpec& spec = scene.spec.systems.front();
  report::Comparison comparison(
      {.problem = {&spec, &registry, run_options(request.scene, spec, registry)},
       .name = request.scene.scene,
       .methods = request.methods,
       .time = request.time,
       .of = request.of,
       .fps = request.out.fps.value_or(kFilmRate)});
  if (comparison.run(progress.watch())) {
    progress.clear();
    comparison.write(request.out.files, request.out.look, [&] { return progress.caught() != 0; });
    put(console.out, request.json ? comparison.json() + '\n' : comparison.table());
    flush_or_throw(console.out, "standard output");
  }
  return progress.exit_code();
}

}  // namespace sim::cli
