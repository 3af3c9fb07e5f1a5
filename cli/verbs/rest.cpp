#include "cli/verbs/rest.h"

#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/output/tables.h"
#include "core/report/rest_report.h"

namespace sim::cli {
void bring_to_rest(LoadedScene& scene, std::ostream* words) {
  for (Simulation& system : scene.systems) {
    const study::Rest rest = report::rest_of(system, SessionSignals::any);
    if (!words) continue;
    const std::string name = scene.spec.world ? system.name() + ": " : "";
    *words << "sim: note: " << name << report::rest_text(rest) << '\n';
  }
}

int rest(const RestRequest& request, const Environment& environment, Registry& registry,
         Console& console) {
  LoadedScene scene = load(request.scene, environment, registry);
  FilePlan plan;
  plan_inputs(scene.spec, registry, plan);
  if (request.dump) plan.writes("--dump", request.dump->file);
  plan.check();
  const bool table_on_out = request.dump && request.dump->standard_output();
  if (request.json && table_on_out)
    throw Error(ErrorKind::kUsage,
                {"two kinds of data for standard output", "--json with --dump",
                 "the summary and the table would mix", "give the table a file, --dump=rest.csv"});
  const Interrupts interrupts;
  std::ostream& words = table_on_out ? console.err : console.out;
  std::vector<const Simulation*> systems;
  for (Simulation& system : scene.systems) {
    const study::Rest rest = report::rest_of(system, SessionSignals::any);
    if (request.json)
      words << report::rest_json(system, rest) << '\n';
    else if (!request.quiet)
      words << (scene.spec.world ? system.name() + ": " : "") << report::rest_text(rest) << '\n';
    systems.push_back(&system);
  }
  if (request.dump) {
    DumpTable table(*request.dump, console.out, {systems, scene.spec.world});
    for (const Simulation* system : systems) table.frame(*system);
    table.commit();
  }
  flush_or_throw(console.out, "standard output");
  return 0;
}

}  // namespace sim::cli
