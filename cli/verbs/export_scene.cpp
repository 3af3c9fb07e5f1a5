#include "cli/verbs/export_scene.h"

#include <filesystem>

#include "cli/run/judged.h"
#include "cli/run/run_files.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/output/staging_folder.h"

namespace sim::cli {
namespace {

namespace fs = std::filesystem;

void check_folder(const std::string& folder, const engine::EngineFiles& files) {
  const std::string& states = files.results.front();
  if (fs::exists(fs::path(folder) / states))
    throw Error(ErrorKind::kIo,
                {"results would be lost", folder, "it holds " + states + " of an earlier export",
                 "sim import it, then give another folder or remove it"});
}

void plan_folder(const std::string& folder, bool whole, const engine::EngineFiles& files,
                 FilePlan& plan) {
  std::vector<std::string> names = files.scene;
  if (whole) names.insert(names.end(), {kEngineNotes, kEngineStart});
  for (const std::string& name : names) plan.writes("the export", folder + "/" + name);
}

// The engine of --format. Throws Error{kUsage} for one without an export.
std::unique_ptr<engine::Engine> exportable(const std::string& name, Registry& registry) {
  const auto made_for = [&](const std::string& each) {
    auto engine = registry.find(kind_of<engine::Engine>, each) ? make_engine(each, registry)
                                                               : std::unique_ptr<engine::Engine>();
    return engine && !engine->files().by_hand.empty() ? std::move(engine) : nullptr;
  };
  if (auto engine = made_for(name)) return engine;
  std::vector<std::string> known;
  for (const std::string& each : registry.names<engine::Engine>())
    if (made_for(each)) known.push_back(each);
  known.emplace_back("h5md");
  throw Error(ErrorKind::kUsage,
              {"unknown format", "--format '" + name + "'",
               "no engine of that name takes a scene by hand", suggestion(name, known)});
}

// The path of the scene relative to the folder, by which it is found again.
SceneRequest findable(SceneRequest request) {
  std::error_code failed;
  if (fs::exists(request.scene, failed)) request.scene = fs::absolute(request.scene).string();
  return request;
}

// One exported system.
struct Exported {
  engine::Exchange scene;
  std::vector<std::int64_t> moments;
  std::string name, folder;  // name: of the system, in the folder of a world

  std::int64_t steps() const { return moments.back() - moments.front(); }
};

std::string part_json(const Exported& part, const Simulation& system) {
  return JsonObject()
      .text("folder", part.folder)
      .integer("particles", system.particles())
      .integer("springs", spring_count(system))
      .integer("steps", part.steps())
      .integer("frames", static_cast<std::int64_t>(part.moments.size()))
      .str();
}

std::string part_text(const Exported& part, const engine::EngineFiles& files,
                      const Simulation& system) {
  const auto frames = static_cast<double>(part.moments.size());
  const double bytes = 8.0 * files.columns * system.particles() * frames;
  return label("wrote", part.folder) + label("particles", std::to_string(system.particles())) +
         label("springs", std::to_string(spring_count(system))) +
         label("steps", std::to_string(part.steps()) + " of " + brief(system.h()) + " s, " +
                            system.method().name()) +
         label("frames",
               std::to_string(part.moments.size()) + ", " + brief(1e-6 * bytes, 3) + " MB") +
         label("run", "cd " + part.folder + "; " + files.by_hand);
}

}  // namespace

int export_scene(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
                 FilePlan plan, Registry& registry, Console& console) {
  const auto engine = exportable(request.export_engine, registry);
  const engine::EngineFiles names = engine->files();
  std::vector<Exported> parts;
  std::vector<Account> starts;
  const RunLength length{request.time, request.steps};
  const auto tenth_of = [&](const Simulation& system) {
    return std::max<std::int64_t>(1, (steps_of(length, system) + 9) / 10);
  };
  std::int64_t every = tenth_of(scene.systems.front());
  for (const Simulation& system : scene.systems) every = std::min(every, tenth_of(system));
  every = request.every.value_or(every);
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    Simulation& system = scene.systems[i];
    const SystemSpec& spec = scene.spec.systems[i];
    Exported part{engine::Exchange(system, spec, engine->name(), engine->methods()), {}, {}, {}};
    const std::int64_t tenth = tenth_of(system);
    Track track(spec, system, steps_of(length, system), every, tenth);
    shorten(length, track);
    if (!accounts.empty()) track.continue_from(accounts[i].start_energy, accounts[i].work);
    const std::int64_t strides[] = {every, tenth};
    part.moments = moments_of(track, strides, 0, nullptr);
    if (scene.spec.world) part.name = "/" + system.name();
    part.folder = request.export_to + part.name;
    starts.push_back({track.start_energy().total(), track.work_memory()});
    parts.push_back(std::move(part));
  }

  plan_folder(request.export_to, true, names, plan);
  if (scene.spec.world)
    for (const Exported& part : parts) plan_folder(part.folder, false, names, plan);
  plan.check();
  check_folder(request.export_to, names);
  for (const Exported& part : parts) check_folder(part.folder, names);
  StagingFolder files(request.export_to);
  const std::string temporary = files.temporary().string();
  EngineNotes notes;
  notes.engine = engine->name();
  if (request.steps)
    notes.steps = request.steps;
  else
    notes.time = request.time.value_or(scene.systems.front().duration());
  notes.every = every;
  notes.without = request.scene.without;
  write_engine_notes(notes, temporary);
  save_checkpoint(temporary + "/" + kEngineStart, findable(request.scene), scene, starts,
                  console.out);
  std::string text;
  std::vector<std::string> objects;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string folder = temporary + parts[i].name;
    fs::create_directories(folder);
    engine->write(parts[i].scene, parts[i].moments, folder);
    objects.push_back(part_json(parts[i], scene.systems[i]));
    text += part_text(parts[i], names, scene.systems[i]);
  }
  files.commit();
  if (request.json)
    text = (scene.spec.world ? json_array(objects) : objects.front()) + '\n';
  else if (request.quiet)
    text.clear();
  else
    text += label("then", "sim import " + request.export_to + " --dump=run.csv");
  put(console.out, text);
  flush_or_throw(console.out, "standard output");
  return 0;
}

int export_state(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
                 FilePlan plan, Registry& registry, Console& console) {
  OutRequest out;
  out.files = {request.export_to};
  plan_outputs(out, scene.names(), plan);
  plan.check();
  Recorder recorder(out, scene, registry);
  long particles = 0, springs = 0;
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    Simulation& system = scene.systems[i];
    Track track(scene.spec.systems[i], system, system.step_count(), Track::kNever, Track::kNever);
    if (!accounts.empty()) track.continue_from(accounts[i].start_energy, accounts[i].work);
    recorder.look(i, track, true);
    particles += system.particles();
    springs += spring_count(system);
  }
  recorder.commit({});
  std::string text;
  if (request.json)
    text = JsonObject()
               .text("file", request.export_to)
               .integer("particles", particles)
               .integer("springs", springs)
               .str() +
           '\n';
  else if (!request.quiet)
    text = label("wrote", request.export_to) + label("particles", std::to_string(particles)) +
           label("springs", std::to_string(springs));
  put(console.out, text);
  flush_or_throw(console.out, "standard output");
  return 0;
}

void complete_import(RunRequest& request, const Checkpoint& saved, Registry& registry) {
  const EngineNotes notes = read_engine_notes(request.engine->results, registry);
  request.engine->name = notes.engine;
  request.engine->result_files = make_engine(notes.engine, registry)->files().results;
  request.scene.scene = saved.scene;
  if (request.scene.without.empty()) request.scene.without = notes.without;
  if (!request.time && !request.steps) {
    request.time = notes.time;
    request.steps = notes.steps;
  }
  if (!request.every) request.every = notes.every;
}

}  // namespace sim::cli
