#include "cli/verbs/rest.h"

#include "cli/terminal/signals.h"
#include "core/base/duration_text.h"
#include "core/base/error.h"
#include "core/base/stopwatch.h"
#include "core/output/format.h"
#include "core/output/tables.h"
#include "core/report/rest_report.h"

namespace sim::cli {
namespace {

// Says that rest is still looked for, soon and then now and again.
class RestWatch {
 public:
  explicit RestWatch(std::ostream* words) : words_(words) {}  // null: says nothing

  bool stop() {
    constexpr double kOften = 10;  // s
    const double seconds = watch_.seconds();
    if (words_ && seconds >= next_) {
      next_ = seconds < kOften ? kOften : next_ + kOften;
      *words_ << "sim: note: no rest yet after " << rough_time(seconds)
              << ", it may take half a minute and more; Ctrl-C ends it\n"
              << std::flush;
    }
    return SessionSignals::any();
  }

 private:
  std::ostream* words_;
  double next_ = 2;  // s
  const Stopwatch watch_;
};

}  // namespace

void bring_to_rest(LoadedScene& scene, std::ostream* words) {
  RestWatch watch(words);
  for (Simulation& system : scene.systems) {
    const study::Rest rest = report::rest_of(system, [&] { return watch.stop(); });
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
  RestWatch watch(request.quiet ? nullptr : &console.err);
  std::vector<const Simulation*> systems;
  for (Simulation& system : scene.systems) {
    const study::Rest rest = report::rest_of(system, [&] { return watch.stop(); });
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
