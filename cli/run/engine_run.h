// A run whose steps are made by another program: ours measures, judges and writes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/judged.h"
#include "cli/run/recorder.h"
#include "cli/terminal/console.h"
#include "core/engine/engine.h"
#include "core/engine/engine_folder.h"
#include "core/engine/first_steps.h"

namespace sim::cli {

// The engine of a plugin. Throws Error{kUsage} for an unknown name, and Error{kPlugin}.
std::unique_ptr<engine::Engine> make_engine(const std::string& name, Registry& registry);

// --engine NAME, or sim import of a folder.
struct EngineRequest {
  std::string name = "lammps";
  engine::Launch launch;
  bool compare = true;  // the first steps with those of the kernel
  std::string results;  // a folder with frames that are there already; empty: it is started
  std::vector<std::string> result_files = {};  // in it, of the engine
};

// The ascending steps of a run at which something is looked at, the present one first, the last one
// that is a whole step at the end. `strides` in steps: of tables and rows of the report; a recorder
// may be null. With drag there are more between them, for the work that it takes; ranks 0: unknown.
std::vector<std::int64_t> moments_of(Track& track, std::span<const std::int64_t> strides, int ranks,
                                     const Recorder* recorder, std::size_t system = 0);

// Notes that a folder needs besides the engine's own files, for `sim import`.
struct EngineNotes {
  std::string engine = "lammps";
  std::optional<double> time;  // s, as asked for; or
  std::optional<std::int64_t> steps;
  std::int64_t every = 1;
  std::vector<std::string> without;  // parts that are left out
};
void write_engine_notes(const EngineNotes& notes, const std::string& folder);
// Throws Error{kIo}, Error{kCheckpoint}, also for results that are no files.
EngineNotes read_engine_notes(const std::string& folder, Registry& registry);

inline constexpr const char* kEngineNotes = "run.txt";
inline constexpr const char* kEngineStart = "start.snap";  // a checkpoint

class EngineRun {
 public:
  // Refuses unsupported requests; writes the files, unless there are results. Track, registry and
  // console outlive it. Throws Error.
  EngineRun(const EngineRequest& request, const SystemSpec& spec, Track& track,
            std::vector<std::int64_t> moments, Registry& registry, bool quiet, Console& console);

  std::string title() const { return title_; }  // "lammps, 2 ranks"
  void start();
  // Advances to the next state. False: a signal came, or the run has diverged, which the track is
  // told then.
  bool advance(Track& track);

 private:
  bool give_up(Track& track);
  void take_first_steps(Simulation& system, std::int64_t most, Registry& registry);
  void compare(const Simulation& system);

  EngineRequest request_;
  bool quiet_;
  Console& console_;
  std::int64_t last_;  // step
  std::string title_;
  std::vector<std::string> command_;
  std::optional<engine::EngineFolder> temporary_;
  std::string folder_;
  std::unique_ptr<engine::Engine> engine_;
  engine::Exchange scene_;
  std::optional<engine::FirstSteps> first_steps_;
  std::unique_ptr<engine::Frames> frames_;
  std::unique_ptr<Process> process_;  // ends before its folder goes
};

}  // namespace sim::cli
