// An external program that makes the steps of a scene: its input files, its start, and its output.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/engine/exchange.h"
#include "core/output/process.h"

namespace sim::engine {

struct Launch {
  int ranks = 1;
  std::vector<std::string> words;  // that start it, without its own arguments; empty: found here
};

// The contents of its log in a folder; empty if there is none.
struct EngineLog {
  std::string version{};                 // "LAMMPS (29 Sep 2021)"
  std::string error{};                   // its last line of an error
  std::optional<std::int64_t> halted{};  // the last step that it could not take further
  std::string why{};                     // it halted
};

// The states that it writes, read one by one while they are written.
class Frames {
 public:
  enum class Next {
    kState,      // the system is at the next frame now
    kNone,       // there is no further whole frame, as yet
    kNotFinite,  // the next frame has numbers that are not; the system stays where it is
  };
  virtual ~Frames() = default;

  // Throws Error{kCheckpoint} for a file that is of another scene or start, or damaged.
  // Frames after step `last` do not count.
  virtual Next next(std::int64_t last) = 0;
  virtual std::int64_t step() const = 0;  // of the frame that was read last
};

// The files of a folder, by their names in it.
struct EngineFiles {
  std::vector<std::string> scene;    // that write() makes
  std::vector<std::string> results;  // that the program leaves, the states first
  int columns = 0;                   // numbers of a particle in a state
  std::string by_hand = {};          // how a person starts it there; empty: not without us
};

// A plugin of the kind `engine`: --engine NAME, sim export --format NAME.
class Engine {
 public:
  virtual ~Engine() = default;

  virtual std::string name() const = 0;
  virtual std::span<const EngineMethod> methods() const = 0;
  virtual EngineFiles files() const = 0;
  // The paths of its programs on this machine, or what is missing.
  virtual std::vector<std::string> programs() const = 0;
  virtual std::string needs() const = 0;
  // True if it solves equations to a tolerance, which is tightened for the first steps.
  virtual bool solves() const { return false; }

  // The words that start it: PROGRAM, or `mpirun -np N PROGRAM`, as paths. Throws Error{kIo} where
  // a program is missing, with the package that has it.
  virtual std::vector<std::string> command(const Launch& launch) const = 0;
  // Writes its files, each whole or not at all. `moments`, ascending, are the steps of which there
  // will be a frame, the present one first and the end last. Throws Error{kIo}, and Error{kScene}
  // for what would take too much memory there.
  virtual void write(const Exchange& scene, std::span<const std::int64_t> moments,
                     const std::string& folder) const = 0;
  virtual std::unique_ptr<Process> start(std::vector<std::string> command,
                                         const std::string& folder) const = 0;
  // The system is in the state in which the scene was written.
  virtual std::unique_ptr<Frames> frames(const std::string& folder, const Exchange& scene,
                                         Simulation& system) const = 0;
  virtual EngineLog log(const std::string& folder) const = 0;
};

// For engines: a program in PATH or by its path; throws Error{kIo}.
std::string program_or_throw(const std::string& name, const std::string& option,
                             const std::string& remedy);
// With mpirun before it, for several ranks.
std::vector<std::string> with_ranks(const std::string& program, int ranks);
// Open MPI is told that ranks may be more than processors, and that those who wait let others work:
// on a busy machine two ranks that spin take ten times as long. The files that it leaves when it is
// stopped are removed with the folder.
std::unique_ptr<Process> start_in(const std::vector<std::string>& command,
                                  const std::string& folder);

}  // namespace sim::engine
