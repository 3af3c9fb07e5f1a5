// LAMMPS as a program beside ours: how it is started, and what it says.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/output/process.h"

namespace sim::engine {

struct LammpsLaunch {
  int ranks = 1;
  std::vector<std::string> words;  // that start it, without its own arguments; empty: found in PATH
};

// The words that start it: `lmp`, or `mpirun -np N lmp`, as paths. Throws Error{kIo} where a
// program is missing, with the package that has it.
std::vector<std::string> lammps_command(const LammpsLaunch& launch);

// What its log in a folder says; empty where there is none.
struct LammpsLog {
  std::string version;                 // "LAMMPS (29 Sep 2021)"
  std::string error;                   // its last line of an error
  std::optional<std::int64_t> halted;  // the step at which its energy was no longer a number
};
LammpsLog read_lammps_log(const std::string& folder);

// A folder for its files, which nobody else may read; removed at the end, or by the next one where
// the process was killed.
class LammpsFolder {
 public:
  LammpsFolder();  // throws Error{kIo}
  ~LammpsFolder();
  LammpsFolder(const LammpsFolder&) = delete;
  LammpsFolder& operator=(const LammpsFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int held_ = -1;  // the folder, locked: its process is alive
};

// Starts it on the script of a folder.
std::unique_ptr<Process> start_lammps(std::vector<std::string> command, const std::string& folder);

}  // namespace sim::engine
