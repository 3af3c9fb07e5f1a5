// LAMMPS as a program beside ours.
#include <algorithm>
#include <cstring>
#include <fstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/engine/engine.h"
#include "core/plugin/plugin.h"
#include "lammps_frames.h"
#include "lammps_input.h"

namespace sim::engine {
namespace {

class Lammps final : public Engine {
 public:
  std::string name() const override { return "lammps"; }
  std::span<const EngineMethod> methods() const override;
  EngineFiles files() const override;
  std::vector<std::string> programs() const override;
  std::string needs() const override;
  std::vector<std::string> command(const Launch& launch) const override;
  void write(const Exchange& scene, std::span<const std::int64_t> moments,
             const std::string& folder) const override;
  std::unique_ptr<Process> start(std::vector<std::string> command,
                                 const std::string& folder) const override;
  std::unique_ptr<Frames> frames(const std::string& folder, const Exchange& scene,
                                 Simulation& system) const override;
  EngineLog log(const std::string& folder) const override;
};

std::span<const EngineMethod> Lammps::methods() const {
  static constexpr EngineMethod kMethods[] = {{"verlet", Method::kVerlet},
                                              {"symplectic_euler", Method::kSymplecticEuler}};
  return kMethods;
}

EngineFiles Lammps::files() const {
  return {{kLammpsScript, kLammpsData, kLammpsMoments},
          {kLammpsFrames, kLammpsLog},
          kLammpsColumns,
          std::string("mpirun -np 4 lmp -in ") + kLammpsScript};
}

std::vector<std::string> Lammps::programs() const {
  const std::string found = find_program("lmp");
  return found.empty() ? std::vector<std::string>{} : std::vector{found};
}

std::string Lammps::needs() const { return "the package lammps"; }

std::vector<std::string> Lammps::command(const Launch& launch) const {
  std::vector<std::string> words = launch.words;
  if (words.empty())
    return with_ranks(program_or_throw("lmp", "--engine lammps",
                                       "apt-get install lammps, or name another with --launch"),
                      launch.ranks);
  words[0] = program_or_throw(words[0], "--launch", "name one that is there");
  return words;
}

void Lammps::write(const Exchange& scene, std::span<const std::int64_t> moments,
                   const std::string& folder) const {
  write_lammps(scene, moments, folder);
}

std::unique_ptr<Process> Lammps::start(std::vector<std::string> command,
                                       const std::string& folder) const {
  command.insert(command.end(), {"-in", kLammpsScript, "-log", kLammpsLog, "-screen", "none"});
  return start_in(command, folder);
}

std::unique_ptr<Frames> Lammps::frames(const std::string& folder, const Exchange& scene,
                                       Simulation& system) const {
  return std::make_unique<LammpsFrames>(folder, scene, system);
}

EngineLog Lammps::log(const std::string& folder) const {
  constexpr std::size_t kLongest = 300;
  constexpr const char* kHalted = "met on step ";
  EngineLog log;
  std::ifstream stream(folder + "/" + kLammpsLog);
  for (std::string line; std::getline(stream, line);) {
    line.resize(std::min(line.size(), kLongest));
    if (log.version.empty() && line.starts_with("LAMMPS (")) log.version = line;
    if (!line.starts_with("ERROR")) continue;
    log.error = line;
    if (const std::size_t at = line.find(kHalted); at != std::string::npos) {
      const std::string rest = line.substr(at + std::strlen(kHalted));
      log.halted = parse_integer(rest.substr(0, rest.find(' ')));
      log.why = "the energy in lammps was no longer a number";
    }
  }
  return log;
}

}  // namespace
}  // namespace sim::engine

SIM_PLUGIN(engine::Engine, "lammps") {
  registrar.add(sim::Plugin<sim::engine::Engine>{
      {.name = "lammps",
       .summary =
           "LAMMPS makes the steps: springs, gravity and drag, by verlet or symplectic_euler",
       .formula = "sim SCENE --engine lammps --ranks N; sim export SCENE DIR",
       .source = "Thompson et al. (2022), Comput. Phys. Commun. 271, 108171"},
      [](const sim::Params&) { return std::make_unique<sim::engine::Lammps>(); }});
}
