// The objects behind the handles of sim.h.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/c/asked.h"
#include "core/c/guard.h"
#include "core/c/record.h"
#include "core/c/sim.h"
#include "core/c/stop.h"
#include "core/c/watcher.h"
#include "core/output/file_plan.h"
#include "core/report/checkpoint_file.h"
#include "core/report/replays.h"
#include "core/study/accuracy/error_goal.h"
#include "core/study/run/track.h"
#include "core/study/study.h"

// Members of a scene in the order in which the later ones refer to the earlier.
struct sim_scene {
  enum class State { kFree, kInCall, kToBeClosed };  // the last one at the end of the call
  mutable std::atomic<State> state = State::kFree;
  std::unique_ptr<sim::Registry> registry;
  std::string name;  // as it was asked for
  bool from_file = false;
  sim::c::Asked asked;
  sim::StudiedScene loaded;
  std::shared_ptr<const char> self = std::make_shared<const char>('\0');  // snapshots know it by it
  std::uint64_t generation = 1;
  std::vector<sim::study::Verdict> verdicts;  // of the last run; empty: there was none
  std::string summary;                        // of it, JSON
  double seconds = 0;                         // that it took
  std::vector<std::string> judged;            // sim_judge_figures()
  // The books of the last run, or of a checkpoint, and the generation that they belong to.
  std::vector<sim::report::Account> accounts;
  std::uint64_t accounts_at = 0;
  bool resumed = false;  // a run goes on with them
  // The choices of sim_choose(), one a system or none at all, and the generation that it left.
  std::vector<std::optional<sim::study::GoalChoice>> choices;
  sim::c::ChoiceRequest chosen;
  std::uint64_t chosen_at = 1;
  // True if a field of the caller asked to stop. Steps pass on no exception but Error.
  std::shared_ptr<bool> field_stopped = std::make_shared<bool>(false);
  // The question of the present call; steps and functions of the scene ask it.
  std::shared_ptr<sim::c::Stop> stop = std::make_shared<sim::c::Stop>();
  std::unique_ptr<sim::c::SceneRecord> record = nullptr;  // of what is done with it
};

struct sim_snapshot {
  std::shared_ptr<const char> scene;
  std::vector<sim::Snapshot> systems;
};

namespace sim::c {

// Holds a scene for the time of a call. Throws Error{kUsage} for null, and for a scene that is in
// another call: of another thread, or the one whose callback this is.
class InCall {
 public:
  explicit InCall(const sim_scene* scene);
  ~InCall();
  InCall(const InCall&) = delete;
  InCall& operator=(const InCall&) = delete;

 private:
  const sim_scene* scene_;
};

// The scene of a file, or of its text. Throws Error, and Stopped where the watcher says so.
std::unique_ptr<sim_scene> opened(const std::string& name, const char* text, const Asked& asked,
                                  Watcher& watcher);

// The request for the scene, as recordings and pages tell it; for checkpoints with the program.
report::NamedScene named_scene(const sim_scene& scene);
report::CheckpointOrigin origin_of(const sim_scene& scene);

// The name of a file that is written whole; `what` goes there. Throws Error{kUsage} for standard
// output and what is no regular file.
std::string checked_file(const char* file, const std::string& what);

// Writers of the files of the scene may not write over these.
FilePlan plan_of(const sim_scene& scene);

// The books of the last run, or of the checkpoint, where these are of the present state.
std::vector<report::Account> accounts_now(const sim_scene& scene);

// The systems of the scene, which are new, ask scene.stop in long steps.
void listen(sim_scene& scene);

// Frees the scene now, or at the end of the call that it is in.
void close(sim_scene* scene) noexcept;

// Calls work(); its exception becomes Stopped if a field of the scene asked for it.
template <class Work>
void stoppable(const sim_scene& scene, Work work) {
  *scene.field_stopped = false;
  try {
    work();
  } catch (...) {
    if (!std::exchange(*scene.field_stopped, false)) throw;
    throw Stopped();
  }
}

// Runs `work` as above; any error after the watcher was told to stop counts as the stop.
template <class Watch, class Work>
auto stoppable_by(const Watch& watcher, Work work) -> decltype(work()) {
  try {
    return work();
  } catch (const Error&) {
    if (watcher.told()) throw Stopped();
    throw;
  }
}

// Throws Error{kUsage} for an index that the scene does not have.
Simulation& system_of(sim_scene* scene, int system);
const Simulation& system_of(const sim_scene* scene, int system);

}  // namespace sim::c
