#include "core/engine/engine.h"

#include <unistd.h>

#include <filesystem>

#include "core/base/error.h"

namespace sim::engine {

std::string program_or_throw(const std::string& name, const std::string& option,
                             const std::string& remedy) {
  if (name.find('/') != std::string::npos) {
    if (::access(name.c_str(), X_OK) == 0) return std::filesystem::absolute(name).string();
  } else if (const std::string found = find_program(name); !found.empty()) {
    return found;
  }
  throw Error(ErrorKind::kIo,
              {"missing program", option, "there is no " + name + " in PATH", remedy});
}

std::vector<std::string> with_ranks(const std::string& program, int ranks) {
  if (ranks == 1) return {program};
  const std::string starter = program_or_throw(
      "mpirun", "--ranks", "apt-get install openmpi-bin, or say how ranks start with --launch");
  return {starter, "-np", std::to_string(ranks), program};
}

std::unique_ptr<Process> start_in(const std::vector<std::string>& command,
                                  const std::string& folder) {
  return std::make_unique<Process>(command, ProcessPlace{folder,
                                                         {"OMPI_MCA_mpi_yield_when_idle=1",
                                                          "OMPI_MCA_rmaps_base_oversubscribe=1",
                                                          "OMPI_MCA_orte_tmpdir_base=" + folder}});
}

}  // namespace sim::engine
