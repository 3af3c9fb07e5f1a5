// A run whose steps are made by another program: ours measures, judges and writes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/engine/engine.h"
#include "core/engine/engine_folder.h"
#include "core/engine/first_steps.h"
#include "core/study/run/track.h"

namespace sim::engine {

// The engine of a plugin. Throws Error{kUsage} for an unknown name, and Error{kPlugin}.
std::unique_ptr<Engine> make_engine(const std::string& name, Registry& registry);

// A request for the steps of an engine, or for those that it has made in a folder of an export.
struct EngineRequest {
  std::string name = "lammps";
  Launch launch;
  bool compare = true;                         // the first steps with those of the kernel
  std::string results;                         // a folder with frames; empty: it is started
  std::vector<std::string> result_files = {};  // in it, of the engine
  std::string without_comparison = "compare=0 goes on all the same";  // a remedy
};

// The ascending steps of a run at which something is looked at, the present one first, the last one
// that is a whole step at the end. `strides` in steps: of tables and rows of the report; `more`, if
// any, tells further ones up to a last step. With drag there are more between them, for the work
// that it takes; ranks 0: unknown.
using MoreMoments =
    std::function<void(std::int64_t last, const std::function<void(std::int64_t)>& tell)>;
std::vector<std::int64_t> moments_of(study::Track& track, std::span<const std::int64_t> strides,
                                     int ranks, const MoreMoments& more = {});

// Notes that a folder needs besides the engine's own files, for an import of its results.
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
  // Refuses unsupported requests; writes the files, unless there are results. Track and registry
  // outlive it; stop() is asked while it waits. Throws Error.
  EngineRun(const EngineRequest& request, const SystemSpec& spec, study::Track& track,
            std::vector<std::int64_t> moments, Registry& registry, std::function<bool()> stop);

  std::string title() const { return title_; }  // "lammps, 2 ranks"
  void start();
  // Advances to the next state. False: it was told to stop, or the run has diverged, which the
  // track is told then.
  bool advance(study::Track& track);
  // How far it agrees with the kernel, once: "LAMMPS .. and the kernel agree to 14 digits at step
  // 20"; empty before that is known.
  std::string take_note() { return std::exchange(note_, {}); }

 private:
  bool give_up(study::Track& track);
  void take_first_steps(Simulation& system, std::int64_t most, Registry& registry);
  void compare(const Simulation& system);

  EngineRequest request_;
  std::function<bool()> stop_;
  std::int64_t last_;  // step
  std::string title_, note_;
  std::vector<std::string> command_;
  std::optional<EngineFolder> temporary_;
  std::string folder_;
  std::unique_ptr<Engine> engine_;
  Exchange scene_;
  std::optional<FirstSteps> first_steps_;
  std::unique_ptr<Frames> frames_;
  std::unique_ptr<Process> process_;  // ends before its folder goes
};

}  // namespace sim::engine
