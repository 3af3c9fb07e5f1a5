#include "cli/command_line/engine_options.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <sstream>

#include "cli/command_line/option_values.h"
#include "core/output/writer.h"

namespace sim::cli {
namespace {

constexpr const char* kExportFooter =
    "Example: sim export scenes/cloth.lua -i verlet -T 1 --format lammps cloth\n"
    "Then, there or on another machine: cd cloth; mpirun -np 4 lmp -in scene.in\n"
    "And back: sim import cloth --dump=run.csv\n"
    "The folder: scene.in, scene.data and moments.txt for LAMMPS, start.snap and\n"
    "run.txt for sim import. LAMMPS adds frames.bin and log.lammps.\n"
    "What LAMMPS would not mean in the same way is refused by name: methods other\n"
    "than verlet and symplectic_euler, single precision, colliders, constraints,\n"
    "contact, forces other than springs without damping, gravity and drag.\n"
    "h5md: the scene as it begins as one file, for h5py and MDAnalysis, and .xmf\n"
    "beside it for ParaView: sim export scenes/jelly.lua --format h5md jelly.h5;\n"
    "--out writes whole runs. It needs a build with libhdf5-dev.\n"
    "page: the scene with the kernel in one file that opens in any browser, to be\n"
    "touched, edited and studied without a server or a network:\n"
    "sim export scenes/flag.lua --format page flag.html; ./dev web builds what it\n"
    "needs. --out FILE.html is a recording.\n";

constexpr const char* kWithoutComparison = "--no-compare goes on all the same";

constexpr const char* kImportFooter =
    "A mesh becomes a scene to edit: sim import bunny.obj --out bunny.lua; without\n"
    "--out it is printed. So does H5MD (.h5): its last state, masses, ties as\n"
    "springs. A folder of sim export, with the frames of its run, becomes what the\n"
    "run itself would have written: sim import cloth --dump=run.csv; all\n"
    "options for tables, files and the verdict hold, as in sim --help.\n";

}  // namespace

std::vector<CLI::Option*> add_engine_options(CLI::App& app, EngineTexts& t) {
  return {
      app.add_option(
             "--engine", t.engine,
             "another program makes the steps:\nlammps, petsc or another of sim list engines")
          ->type_name("NAME"),
      app.add_option("--ranks", t.ranks, "processes of it; 1 if not given")->type_name("N"),
      app.add_option("--launch", t.launch,
                     "the words that start it, instead of mpirun:\n\"srun -n 512 lmp\"")
          ->type_name("WORDS"),
      app.add_flag("--no-compare", t.no_compare, "do not compare its first 20 steps with our own")
          ->disable_flag_override()};
}

CLI::App* add_export(CLI::App& app, EngineTexts& t) {
  CLI::App* verb =
      app.add_subcommand("export", "SCENE DIR: files for LAMMPS; SCENE FILE: .h5, a page");
  verb->fallthrough()->allow_extras();
  verb->get_formatter()->column_width(26);
  verb->add_option("SCENE", t.scene, "Lua file")->type_name("");
  verb->add_option("DIR", t.folder, "a folder, made if it is not there; or a file")->type_name("");
  verb->add_option("--format", t.format,
                   "lammps, or another engine (a folder); h5md or page\n(a file)")
      ->type_name("F");
  verb->footer(
      std::string("It takes -i, -d, --time, --steps, --every, --resume, --from-rest, --quiet,\n"
                  "--set, --off, --without, --seed and --json, as in sim --help.\n") +
      kExportFooter);
  return verb;
}

CLI::App* add_import(CLI::App& app, EngineTexts& t) {
  CLI::App* verb = app.add_subcommand("import", "MESH or FILE.h5: a scene to edit; DIR: results");
  verb->fallthrough()->allow_extras();
  verb->get_formatter()->column_width(26);
  verb->add_option("SOURCE", t.source, "a mesh (.obj, .ply; in m), .h5, or a folder")
      ->type_name("");
  verb->footer(kImportFooter);
  return verb;
}

const std::vector<std::string>& export_takes() {
  static const std::vector<std::string> names = {
      "--integrator", "--dt", "--time", "--steps", "--every", "--resume", "--from-rest", "--quiet"};
  return names;
}

const std::vector<std::string>& import_takes() {
  static const std::vector<std::string> names = {
      "--time",    "--steps",      "--energy", "--dump",      "--observe",  "--every",
      "--snap",    "--check",      "--verify", "--no-verify", "--progress", "--quiet",
      "--out",     "--fps",        "--color",  "--springs",   "--trail",    "--wireframe",
      "--surface", "--no-compare", "--camera", "--size",      "--show",     "--debug-particle"};
  return names;
}

void complete_engine(RunRequest& request, const EngineTexts& t) {
  if (t.engine.empty()) {
    if (!t.ranks.empty() || !t.launch.empty())
      usage_error("an engine is missing", t.ranks.empty() ? "--launch" : "--ranks",
                  "it starts another program", "add --engine lammps or petsc");
    return;
  }
  if (request.replay)
    usage_error("no hands there", "--engine with --replay", "an engine knows no hands",
                "leave --engine out");
  engine::EngineRequest engine;
  engine.without_comparison = kWithoutComparison;
  engine.name = t.engine;
  constexpr std::int64_t kMostRanks = 1'000'000;
  if (!t.ranks.empty())
    engine.launch.ranks = static_cast<int>(integer_between("--ranks", t.ranks, 1, kMostRanks));
  std::istringstream words(t.launch);
  for (std::string word; words >> word;) engine.launch.words.push_back(word);
  if (!t.launch.empty() && engine.launch.words.empty())
    usage_error("bad value", "--launch '" + t.launch + "'", "it has no words",
                "as in --launch \"srun -n 512 lmp\"");
  if (!engine.launch.words.empty() && !t.ranks.empty())
    usage_error("two numbers of ranks", "--ranks and --launch", "the words of --launch say it",
                "leave --ranks out");
  engine.compare = !t.no_compare;
  request.engine = engine;
}

RunRequest export_request(const EngineTexts& t, RunRequest run) {
  if (t.scene.empty() || t.folder.empty())
    usage_error("argument missing", "sim export", "it needs a scene and a folder",
                "as in: sim export scenes/cloth.lua -i verlet --format lammps cloth");
  run.export_to = t.folder;
  run.export_engine = t.format;
  run.export_page = t.format == "page";
  run.export_file = t.format == "h5md";
  if (run.export_page && ending_of(t.folder) != "html")
    usage_error("unknown ending of a file", t.folder, "a page is .html", "name it so");
  if (run.export_page && (run.time || run.steps || run.every || run.resume || run.from_rest))
    usage_error("option of a run", t.folder, "--format page writes the scene, not a run",
                "sim SCENE --out run.html writes a run");
  if (run.export_file && !is_hdf5(ending_of(t.folder)))
    usage_error("unknown ending of a file", t.folder, "H5MD is .h5", "name it so");
  if (run.export_file && (run.time || run.steps || run.every))
    usage_error("option of a run", t.folder, "--format h5md writes the state it begins with",
                "sim SCENE --out run.h5 writes a run");
  return run;
}

bool imports_results(const EngineTexts& t) {
  std::error_code failed;
  return std::filesystem::is_directory(t.source, failed);
}

RunRequest results_request(const EngineTexts& t, RunRequest run) {
  run.engine = engine::EngineRequest{.launch = {},
                                     .compare = !t.no_compare,
                                     .results = t.source,
                                     .without_comparison = kWithoutComparison};
  run.resume = t.source + "/" + engine::kEngineStart;
  return run;
}

ImportRequest import_request(const EngineTexts& t, const RunRequest& run, const OutTexts& out) {
  if (t.source.empty())
    usage_error("argument missing", "sim import", "it needs a mesh or a folder",
                "as in: sim import bunny.obj");
  if (run.dump || run.energy || run.observe || run.snap || run.time || run.steps || run.every ||
      run.checks || run.debug_particle)
    usage_error("option of a run", t.source, "a mesh is no run",
                "give the folder of an export, or leave options of runs out");
  return {t.source, one_file(out, ".lua", "a scene is .lua")};
}

}  // namespace sim::cli
