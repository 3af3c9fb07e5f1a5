// Runs on other programs: --engine, sim export, sim import.
#pragma once

#include <string>
#include <vector>

#include "cli/command_line/out_options.h"
#include "cli/run/run.h"
#include "cli/verbs/import_scene.h"

namespace sim::cli {

// The texts of the options, as the command line has them.
struct EngineTexts {
  std::string engine, ranks, launch, format = "lammps";
  std::string scene, folder;  // of sim export
  std::string source;         // of sim import
  bool no_compare = false;
};

std::vector<CLI::Option*> add_engine_options(CLI::App& app, EngineTexts& texts);
CLI::App* add_export(CLI::App& app, EngineTexts& texts);
CLI::App* add_import(CLI::App& app, EngineTexts& texts);

// The options of a run that these verbs take, too.
const std::vector<std::string>& export_takes();
const std::vector<std::string>& import_takes();

// These read --engine and the options beside it; each throws Error{kUsage}.
void complete_engine(RunRequest& request, const EngineTexts& texts);
// `run` is what the other options say.
RunRequest export_request(const EngineTexts& texts, RunRequest run);
bool imports_results(const EngineTexts& texts);  // of a folder, not a mesh
RunRequest results_request(const EngineTexts& texts, RunRequest run);
ImportRequest import_request(const EngineTexts& texts, const RunRequest& run, const OutTexts& out);

}  // namespace sim::cli
