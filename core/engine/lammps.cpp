#include "core/engine/lammps.h"

#include <algorithm>
#include <cstring>
#include <fstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/engine/lammps_frames.h"
#include "core/engine/lammps_input.h"

namespace sim::engine {

std::span<const EngineMethod> Lammps::methods() const {
  static constexpr EngineMethod kMethods[] = {{"verlet", Method::kVerlet},
                                              {"symplectic_euler", Method::kSymplecticEuler}};
  return kMethods;
}

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
  return start_in(std::move(command), folder);
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

}  // namespace sim::engine
