#include "cli/verbs/export_scene.h"

#include "cli/run/judged.h"
#include "cli/run/run_files.h"
#include "core/base/text.h"
#include "core/engine/export_scene.h"
#include "core/output/format.h"
#include "core/report/scene_page.h"

namespace sim::cli {
namespace {

std::string part_text(const engine::ExportedPart& part, const engine::EngineFiles& files) {
  const Simulation& system = *part.system;
  const double bytes = 8.0 * files.columns * system.particles() * static_cast<double>(part.frames);
  return label("wrote", part.folder) + label("particles", std::to_string(system.particles())) +
         label("springs", std::to_string(spring_count(system))) +
         label("steps", std::to_string(part.steps) + " of " + brief(system.h()) + " s, " +
                            system.method().name()) +
         label("frames", std::to_string(part.frames) + ", " + brief(1e-6 * bytes, 3) + " MB") +
         label("run", "cd " + part.folder + "; " + files.by_hand);
}

// One line for machines, or some for people.
void tell(const RunRequest& request, const std::string& json, const std::string& text,
          Console& console) {
  put(console.out, request.json ? json + '\n' : request.quiet ? std::string() : text);
  flush_or_throw(console.out, "standard output");
}

}  // namespace

int export_scene(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
                 FilePlan plan, Registry& registry, Console& console) {
  const auto engine = engine::exportable_engine(request.export_engine, "--format", registry);
  const engine::ExportTask task{.engine = engine->name(),
                                .folder = request.export_to,
                                .length = {request.time, request.steps},
                                .every = request.every,
                                .without = request.scene.without,
                                .origin = origin_of(request.scene)};
  std::string text;
  std::vector<std::string> objects;
  for (const engine::ExportedPart& part :
       engine::export_scene(task, *engine, scene, accounts, std::move(plan), registry)) {
    objects.push_back(part.json());
    text += part_text(part, engine->files());
  }
  tell(request, scene.spec.world ? json_array(objects) : objects.front(),
       text + label("then", "sim import " + request.export_to + " --dump=run.csv"), console);
  return 0;
}

int export_state(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
                 FilePlan plan, Registry& registry, Console& console) {
  OutRequest out;
  out.files = {request.export_to};
  plan_outputs(out, scene.names(), plan);
  plan.check();
  Recorder recorder(out, scene, registry);
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    Simulation& system = scene.systems[i];
    Track track(scene.spec.systems[i], system, system.step_count(), Track::kNever, Track::kNever);
    if (!accounts.empty()) track.continue_from(accounts[i].start_energy, accounts[i].work);
    recorder.look(i, track, true);
  }
  recorder.commit({});
  const report::SceneCounts counts = report::counts_of(scene);
  tell(request, counts.json(request.export_to),
       label("wrote", request.export_to) + label("particles", std::to_string(counts.particles)) +
           label("springs", std::to_string(counts.springs)),
       console);
  return 0;
}

int export_page(const RunRequest& request, const LoadedScene& scene, const Environment& environment,
                FilePlan plan, Console& console) {
  const report::NamedScene named = named_scene(request.scene);
  const std::size_t bytes = report::write_scene_page({.scene = &named,
                                                      .spec = &scene.spec,
                                                      .folders = environment.scene_folders,
                                                      .page = page_with_kernel(),
                                                      .file = request.export_to},
                                                     std::move(plan));
  tell(request,
       JsonObject()
           .text("file", request.export_to)
           .integer("bytes", static_cast<std::int64_t>(bytes))
           .str(),
       label("wrote", request.export_to) +
           label("opens", "in any browser, without a server or a network"),
       console);
  return 0;
}

void complete_import(RunRequest& request, const Checkpoint& saved, Registry& registry) {
  const engine::EngineNotes notes = engine::read_engine_notes(request.engine->results, registry);
  request.engine->name = notes.engine;
  request.engine->result_files = engine::make_engine(notes.engine, registry)->files().results;
  request.scene.scene = saved.scene;
  if (request.scene.without.empty()) request.scene.without = notes.without;
  if (!request.time && !request.steps) {
    request.time = notes.time;
    request.steps = notes.steps;
  }
  if (!request.every) request.every = notes.every;
}

}  // namespace sim::cli
