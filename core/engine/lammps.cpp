#include "core/engine/lammps.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/engine/lammps_input.h"

namespace sim::engine {
namespace {

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

constexpr const char* kFolder = "sim-engine-";

// The open folder, or -1 where another process holds it.
int lock(const std::string& folder) {
  const int held = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (held < 0 || ::flock(held, LOCK_EX | LOCK_NB) == 0) return held;
  ::close(held);
  return -1;
}

// Folders of processes that were killed. One that is a minute old and not held is such.
void remove_leftovers() {
  namespace fs = std::filesystem;
  std::error_code failed;
  for (fs::directory_iterator entry(fs::temp_directory_path(), failed), end;
       !failed && entry != end; entry.increment(failed)) {
    struct stat status {};
    if (!entry->path().filename().string().starts_with(kFolder) ||
        ::lstat(entry->path().c_str(), &status) != 0 || !S_ISDIR(status.st_mode) ||
        status.st_uid != ::geteuid() || status.st_ctime + 60 > ::time(nullptr))
      continue;
    const int held = lock(entry->path().string());
    std::error_code ignored;
    if (held >= 0) fs::remove_all(entry->path(), ignored);
    if (held >= 0) ::close(held);
  }
}

constexpr const char* kPackage = "apt-get install lammps, or name another with --launch";

}  // namespace

std::vector<std::string> lammps_command(const LammpsLaunch& launch) {
  std::vector<std::string> words = launch.words;
  if (!words.empty()) {
    words[0] = program_or_throw(words[0], "--launch", "name one that is there");
    return words;
  }
  words.push_back(program_or_throw("lmp", "--engine lammps", kPackage));
  if (launch.ranks == 1) return words;
  const std::string starter = program_or_throw(
      "mpirun", "--ranks", "apt-get install openmpi-bin, or say how ranks start with --launch");
  words.insert(words.begin(), {starter, "-np", std::to_string(launch.ranks)});
  return words;
}

LammpsLog read_lammps_log(const std::string& folder) {
  constexpr std::size_t kLongest = 300;
  constexpr const char* kHalted = "met on step ";
  LammpsLog log;
  std::ifstream stream(folder + "/" + kLammpsLog);
  for (std::string line; std::getline(stream, line);) {
    line.resize(std::min(line.size(), kLongest));
    if (log.version.empty() && line.starts_with("LAMMPS (")) log.version = line;
    if (!line.starts_with("ERROR")) continue;
    log.error = line;
    if (const std::size_t at = line.find(kHalted); at != std::string::npos) {
      const std::string rest = line.substr(at + std::strlen(kHalted));
      log.halted = parse_integer(rest.substr(0, rest.find(' ')));
    }
  }
  return log;
}

LammpsFolder::LammpsFolder() {
  remove_leftovers();
  path_ = (std::filesystem::temp_directory_path() / (std::string(kFolder) + "XXXXXX")).string();
  if (!::mkdtemp(path_.data()))
    throw Error(ErrorKind::kIo, {"cannot make a folder", path_, std::strerror(errno),
                                 "TMPDIR says where folders of a moment are"});
  held_ = lock(path_);
}

LammpsFolder::~LammpsFolder() {
  // What Open MPI still writes while it ends may come between.
  constexpr int kTries = 50;  // 10 ms apart
  std::error_code ignored;
  for (int tried = 0; tried < kTries && std::filesystem::exists(path_, ignored); ++tried) {
    const timespec moment{0, tried == 0 ? 0 : 10'000'000};
    ::nanosleep(&moment, nullptr);
    std::filesystem::remove_all(path_, ignored);
  }
  if (held_ >= 0) ::close(held_);
}

// Open MPI is told that ranks may be more than processors, and that those who wait let others work:
// on a busy machine two ranks that spin take ten times as long. What it leaves where it is stopped
// goes with the folder.
std::unique_ptr<Process> start_lammps(std::vector<std::string> command, const std::string& folder) {
  command.insert(command.end(), {"-in", kLammpsScript, "-log", kLammpsLog, "-screen", "none"});
  return std::make_unique<Process>(command, ProcessPlace{folder,
                                                         {"OMPI_MCA_mpi_yield_when_idle=1",
                                                          "OMPI_MCA_rmaps_base_oversubscribe=1",
                                                          "OMPI_MCA_orte_tmpdir_base=" + folder}});
}

}  // namespace sim::engine
