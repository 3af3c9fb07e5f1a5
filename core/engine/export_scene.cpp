#include "core/engine/export_scene.h"

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/staging_folder.h"
#include "core/report/summary.h"

namespace sim::engine {
namespace {

void check_export_folder(const std::string& folder, const EngineFiles& files) {
  const std::string& states = files.results.front();
  if (std::filesystem::exists(std::filesystem::path(folder) / states))
    throw Error(ErrorKind::kIo,
                {"results would be lost", folder, "it holds " + states + " of an earlier export",
                 "sim import it, then give another folder or remove it"});
}

void plan_export_folder(const std::string& folder, bool whole, const EngineFiles& files,
                        FilePlan& plan) {
  std::vector<std::string> names = files.scene;
  if (whole) names.insert(names.end(), {kEngineNotes, kEngineStart});
  for (const std::string& name : names) plan.writes("the export", folder + "/" + name);
}

// One system on its way out.
struct OutgoingPart {
  Exchange scene;
  std::vector<std::int64_t> moments;
  std::string name, folder;  // name: of the system, in the folder of a world
};

}  // namespace

std::string ExportedPart::json() const {
  return JsonObject()
      .text("folder", folder)
      .integer("particles", system->particles())
      .integer("springs", report::spring_count(*system))
      .integer("steps", steps)
      .integer("frames", frames)
      .str();
}

std::unique_ptr<Engine> exportable_engine(const std::string& name, const std::string& where,
                                          Registry& registry) {
  const auto made_for = [&](const std::string& each) {
    auto engine = registry.find(kind_of<Engine>, each) ? make_engine(each, registry)
                                                       : std::unique_ptr<Engine>();
    return engine && !engine->files().by_hand.empty() ? std::move(engine) : nullptr;
  };
  if (auto engine = made_for(name)) return engine;
  std::vector<std::string> known;
  for (const std::string& each : registry.names<Engine>())
    if (made_for(each)) known.push_back(each);
  known.emplace_back("h5md");
  throw Error(ErrorKind::kUsage,
              {"unknown format", where + " '" + name + "'",
               "no engine of that name takes a scene by hand", suggestion(name, known)});
}

std::vector<ExportedPart> export_scene(const ExportTask& task, const Engine& engine,
                                       StudiedScene& scene,
                                       std::span<const report::Account> accounts, FilePlan plan,
                                       Registry& registry) {
  const EngineFiles names = engine.files();
  std::vector<OutgoingPart> parts;
  std::vector<report::Account> starts;
  const auto tenth_of = [&](const Simulation& system) {
    return std::max<std::int64_t>(1, (study::steps_of(task.length, system) + 9) / 10);
  };
  std::int64_t every = tenth_of(scene.systems.front());
  for (const Simulation& system : scene.systems) every = std::min(every, tenth_of(system));
  every = task.every.value_or(every);
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    Simulation& system = scene.systems[i];
    const SystemSpec& spec = scene.spec.systems[i];
    OutgoingPart part{Exchange(system, spec, engine.name(), engine.methods()), {}, {}, {}};
    const std::int64_t tenth = tenth_of(system);
    study::Track track(spec, system, study::steps_of(task.length, system), every, tenth);
    study::shorten(task.length, track);
    if (!accounts.empty()) track.continue_from(accounts[i].start_energy, accounts[i].work);
    const std::int64_t strides[] = {every, tenth};
    part.moments = moments_of(track, strides, 0);
    if (scene.spec.world) part.name = "/" + system.name();
    part.folder = task.folder + part.name;
    starts.push_back({track.start_energy().total(), track.work_memory()});
    parts.push_back(std::move(part));
  }

  plan_export_folder(task.folder, true, names, plan);
  if (scene.spec.world)
    for (const OutgoingPart& part : parts) plan_export_folder(part.folder, false, names, plan);
  plan.check();
  check_export_folder(task.folder, names);
  for (const OutgoingPart& part : parts) check_export_folder(part.folder, names);
  StagingFolder files(task.folder);
  const std::string temporary = files.temporary().string();
  EngineNotes notes;
  notes.engine = engine.name();
  if (task.length.steps)
    notes.steps = task.length.steps;
  else
    notes.time = task.length.time.value_or(scene.systems.front().duration());
  notes.every = every;
  notes.without = task.without;
  write_engine_notes(notes, temporary);
  // The scene is found again from other folders, too.
  report::CheckpointOrigin origin = task.origin;
  std::error_code failed;
  if (std::filesystem::exists(origin.scene, failed))
    origin.scene = std::filesystem::absolute(origin.scene).string();
  report::make_checkpoint(temporary + "/" + kEngineStart, origin, scene, registry, starts,
                          std::cout)
      ->commit_safely();
  std::vector<ExportedPart> exported;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string folder = temporary + parts[i].name;
    std::filesystem::create_directories(folder);
    engine.write(parts[i].scene, parts[i].moments, folder);
    exported.push_back({parts[i].folder, &scene.systems[i],
                        parts[i].moments.back() - parts[i].moments.front(),
                        static_cast<std::int64_t>(parts[i].moments.size())});
  }
  files.commit();
  return exported;
}

}  // namespace sim::engine
