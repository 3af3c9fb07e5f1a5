#include "cli/run/run_files.h"

#include <filesystem>
#include <set>

#include "cli/run/error_choice.h"
#include "cli/run/run_checkpoints.h"
#include "core/base/error.h"
#include "core/output/output.h"
#include "core/output/writer.h"

namespace sim::cli {
namespace {

bool takes_standard_output(const std::optional<Target>& target) {
  return target && target->standard_output();
}

}  // namespace

std::vector<std::pair<const char*, const Target*>> tables_of(const RunRequest& request) {
  std::vector<std::pair<const char*, const Target*>> tables;
  if (request.dump) tables.emplace_back("--dump", &*request.dump);
  if (request.energy) tables.emplace_back("--energy", &*request.energy);
  if (request.observe) tables.emplace_back("--observe", &*request.observe);
  if (request.tension) tables.emplace_back("--tension", &*request.tension);
  return tables;
}

bool table_on_standard_output(const RunRequest& request) {
  return takes_standard_output(request.dump) || takes_standard_output(request.energy) ||
         takes_standard_output(request.observe) || takes_standard_output(request.tension);
}

std::ostream& words(const RunRequest& request, Console& console) {
  return table_on_standard_output(request) ? console.err : console.out;
}

void plan_outputs(const OutRequest& request, const std::vector<std::string>& systems,
                  FilePlan& plan) {
  for (const std::string& file : request.files)
    for (const std::string& name : written_names(file, systems)) plan.writes("--out", name);
}

// A checkpoint may take the place of the one that the run goes on from.
FilePlan plan_of(const RunRequest& request, const std::vector<std::string>& systems) {
  FilePlan plan;
  const bool goes_on = request.resume && request.snap &&
                       resolved_file(*request.resume) == resolved_file(*request.snap);
  if (request.resume && !goes_on) plan.reads("--resume", *request.resume);
  if (request.engine && !request.engine->results.empty()) {
    std::vector<std::string> names = request.engine->result_files;
    names.insert(names.end(), {engine::kEngineNotes, engine::kEngineStart});
    for (const std::string& name : names)
      plan.reads("the export", request.engine->results + "/" + name);
  }
  if (request.replay) plan.reads("--replay", *request.replay);
  for (const auto& [option, table] : tables_of(request)) plan.writes(option, table->file);
  if (request.snap) plan.writes("--snap", *request.snap, names_beside_checkpoint(*request.snap));
  plan_outputs(request.out, systems, plan);
  return plan;
}

void check_request(const RunRequest& request) {
  check_error_request(request);
  if (request.snap_every && !request.snap)
    throw Error(ErrorKind::kUsage, {"no checkpoint to write", "--snap-every",
                                    "it says how often, and there is no file", "add --snap FILE"});
  plan_of(request).check();
  const auto tables = tables_of(request);
  if (request.json && table_on_standard_output(request))
    throw Error(ErrorKind::kUsage, {"two kinds of data for standard output",
                                    "--json with --dump, --energy, --observe or --tension",
                                    "the summary and the table would mix",
                                    "give the table a file, as in --dump=run.csv"});
  if (!request.of.empty() && request.engine)
    throw Error(ErrorKind::kUsage, {"not with an engine", "--of", "it shows only some of its steps",
                                    "leave one of the two out"});
  const bool runs = request.time || request.steps;
  if (request.debug_particle && !runs && !tables.empty())
    throw Error(
        ErrorKind::kUsage,
        {"no run to write a table of", std::string("--debug-particle with ") + tables.front().first,
         "--debug-particle alone stops before the first step", "add --time or --steps"});
}

void collect_leftovers_of(const RunRequest& request) {
  std::vector<std::string> files = request.out.files;
  for (const auto& [option, table] : tables_of(request)) files.push_back(table->file);
  if (request.snap) files.push_back(*request.snap);
  std::set<std::filesystem::path> folders;
  for (const std::string& file : files)
    if (file != "-" && !file.starts_with("/dev/"))
      folders.insert(std::filesystem::absolute(file).parent_path());
  for (const auto& folder : folders) collect_leftovers(folder);
}

}  // namespace sim::cli
