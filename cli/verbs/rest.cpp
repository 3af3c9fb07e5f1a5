#include "cli/verbs/rest.h"

#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/output/tables.h"

namespace sim::cli {
namespace {

study::Rest find(Simulation& system) {
  const study::Rest rest = study::come_to_rest(system, SessionSignals::any);
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
      .str();
}

}  // namespace

std::string rest_text(const study::Rest& rest) {
  return "at rest: the largest force left is " + brief(rest.force, 3) + " N of " +
         brief(rest.in_play, 3) + " N in play; potential energy " + brief(rest.potential, 10) +
         " J; " + std::to_string(rest.effort.steps) + " steps, " +
         std::to_string(rest.effort.newton) + " of Newton's method";
}

void bring_to_rest(LoadedScene& scene, std::ostream* words) {
  for (Simulation& system : scene.systems) {
    const study::Rest rest = find(system);
    if (!words) continue;
    const std::string name = scene.spec.world ? system.name() + ": " : "";
    *words << "sim: note: " << name << rest_text(rest) << '\n';
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
    const study::Rest rest = find(system);
    if (request.json)
      words << rest_json(system, rest) << '\n';
    else if (!request.quiet)
      words << (scene.spec.world ? system.name() + ": " : "") << rest_text(rest) << '\n';
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
