// Other programs: their steps, files for them, and files of theirs.
#include <cmath>
#include <sstream>

#include "core/base/text.h"
#include "core/c/asked_words.h"
#include "core/c/handles.h"
#include "core/c/pictures.h"
#include "core/c/run.h"
#include "core/engine/export_scene.h"
#include "core/engine/import_file.h"
#include "core/output/format.h"
#include "core/output/writer.h"
#include "core/report/scene_page.h"
#include "core/report/summary.h"

using namespace sim;
using namespace sim::c;

namespace {

constexpr double kMostRanks = 1e6;

// A whole number from `least` on; nothing where the word is missing.
std::optional<std::int64_t> whole_number(AskedWords& words, const std::string& name, double least,
                                         double most = study::kMostSteps) {
  const std::optional<double> number = words.number(name);
  if (!number) return {};
  if (*number != std::floor(*number) || *number < least || *number > most)
    refuse("bad value", name + " " + brief(*number),
           "it is not a whole number from " + brief(least) + " to " + brief(most),
           "write it like " + name + "=100");
  return static_cast<std::int64_t>(*number);
}

study::RunLength length_of(AskedWords& words) {
  study::RunLength length{words.number("time"), whole_number(words, "steps", 0)};
  if (length.time && length.steps)
    refuse("two lengths", "time and steps", "only one of them can hold", "leave one out");
  if (length.time && !std::isfinite(*length.time))
    refuse("bad value", "time", "it is not finite", "give it in s");
  return length;
}

engine::EngineRequest engine_of(AskedWords& words) {
  engine::EngineRequest request;
  if (const std::string name = words.text("engine"); !name.empty()) request.name = name;
  const auto ranks = whole_number(words, "ranks", 1, kMostRanks);
  if (ranks) request.launch.ranks = static_cast<int>(*ranks);
  std::istringstream launch(words.text("launch"));
  for (std::string word; launch >> word;) request.launch.words.push_back(word);
  if (ranks && !request.launch.words.empty())
    refuse("two numbers of ranks", "ranks and launch", "the words of launch say it",
           "leave ranks out");
  request.compare = words.flag("compare", true);
  request.results = words.text("results");
  return request;
}

std::string run_with_engine(sim_scene& scene, AskedWords& words, int verify, Watcher& watcher) {
  refuse_in_record(scene, "run_engine");
  engine::EngineRequest request = engine_of(words);
  RunTask task{.length = length_of(words), .verify = verify, .engine = &request};
  words.finish("a run of an engine");
  if (!request.results.empty()) {
    const engine::EngineNotes notes = engine::read_engine_notes(request.results, *scene.registry);
    request.name = notes.engine;
    request.result_files = engine::make_engine(notes.engine, *scene.registry)->files().results;
    if (!task.length->time && !task.length->steps) task.length = {notes.time, notes.steps};
    task.rows = notes.every;
  }
  std::vector<std::string> notes, texts;
  task.notes = &notes;
  c::run(scene, task, watcher);
  for (const std::string& note : notes) texts.push_back(json_string(note));
  return JsonObject().text("engine", request.name).json("notes", json_array(texts)).str();
}

void check_ending(const std::string& file, bool right, const std::string& wanted) {
  if (!right) refuse("unknown ending of a file", file, wanted, "name it so");
}

std::string exported(sim_scene& scene, const std::string& format, const std::string& to,
                     AskedWords& words) {
  const study::RunLength length = length_of(words);
  const std::optional<std::int64_t> every = whole_number(words, "every", 1);
  words.finish("an export");
  const bool page = format == "page", file = format == "h5md";
  if ((page || file) && (length.time || length.steps || every))
    refuse("words of a run", to, "the format has the scene as it is", "leave them out");
  if (page) {
    check_ending(to, ending_of(to) == "html", "a page is .html");
    if (!scene.from_file)
      refuse("no file of a scene", scene.name, "a page has the file of its scene",
             "write the text to a file, and open that");
    const report::NamedScene named = named_scene(scene);
    const std::size_t bytes =
        report::write_scene_page({.scene = &named,
                                  .spec = &scene.loaded.spec,
                                  .folders = environment_of(scene.asked).scene_folders,
                                  .page = page_of_library(),
                                  .file = to},
                                 plan_of(scene));
    return JsonObject().text("file", to).integer("bytes", static_cast<std::int64_t>(bytes)).str();
  }
  if (file) {
    check_ending(to, is_hdf5(ending_of(to)), "H5MD is .h5");
    write_state(scene, to);
    return report::counts_of(scene.loaded).json(to);
  }
  const auto engine = engine::exportable_engine(format, "format", *scene.registry);
  const engine::ExportTask task{.engine = engine->name(),
                                .folder = to,
                                .length = length,
                                .every = every,
                                .without = scene.asked.variant.without,
                                .origin = origin_of(scene)};
  std::vector<report::Account> accounts;
  if (scene.accounts_at == scene.generation) accounts = scene.accounts;
  std::vector<std::string> objects;
  for (const engine::ExportedPart& part :
       engine::export_scene(task, *engine, scene.loaded, accounts, plan_of(scene), *scene.registry))
    objects.push_back(part.json());
  return scene.loaded.spec.world ? json_array(objects) : objects.front();
}

}  // namespace

extern "C" {

char* sim_run_engine(sim_scene* scene, const char* const* asked, int verify, sim_watch watch,
                     void* user, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    check_verify(verify);
    AskedWords words(asked);
    Watcher watcher(watch, user);
    const std::string told =
        stoppable_by(watcher, [&] { return run_with_engine(*scene, words, verify, watcher); });
    if (watcher.told()) throw Stopped();
    return given_away(told);
  });
}

char* sim_export(sim_scene* scene, const char* format, const char* to, const char* const* asked,
                 sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    AskedWords words(asked);
    const std::string name = checked_text(format, "format");
    return given_away(exported(*scene, name, checked_file(to, "an export"), words));
  });
}

char* sim_import(const char* file, char** notes, sim_error* error) {
  if (notes) *notes = nullptr;
  return guarded_pointer(error, [&] {
    std::string scene, told;
    engine::import_file({.file = checked_text(file, "file"),
                         .read_h5md = helper_of_library("read_h5md"),
                         .write = [&](std::string_view block) { scene += block; },
                         .tell = [&](const std::string& note) { told += note + '\n'; }});
    std::unique_ptr<char, void (*)(void*)> text(given_away(scene), sim_free);
    if (notes) *notes = given_away(told);
    return text.release();
  });
}

}  // extern "C"
