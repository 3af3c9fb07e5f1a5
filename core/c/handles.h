// The objects behind the handles of sim.h, and the codes of exceptions.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/c/asked.h"
#include "core/c/sim.h"
#include "core/c/stop.h"
#include "core/report/checkpoint_file.h"
#include "core/study/accuracy/error_goal.h"
#include "core/study/run/track.h"
#include "core/study/study.h"

// Members of a scene in the order in which the later ones refer to the earlier.
struct sim_scene {
  enum class State { kFree, kInCall, kToBeClosed };  // the last one at the end of the call
  mutable std::atomic<State> state = State::kFree;
  std::unique_ptr<sim::Registry> registry;
  std::string name;  // as it was asked for
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
};

struct sim_snapshot {
  std::shared_ptr<const char> scene;
  std::vector<sim::Snapshot> systems;
};

namespace sim::c {

// Thrown when a callback asks to stop.
struct Stopped : std::exception {};

[[noreturn]] inline void refuse(const std::string& what, const std::string& where,
                                const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {what, where, why, remedy});
}

template <class Handle>
Handle& checked(Handle* handle, const char* name) {
  if (!handle) refuse("null handle", name, "there is nothing to work on", "give one that is open");
  return *handle;
}

// A structure of a program that was compiled against another version of the header: what it does
// not know is 0, and what it knows and this library does not has to be. `begin`: how it begins.
template <class Structure>
Structure whole_of(const Structure& given, const std::string& begin) {
  constexpr std::size_t kLeast = sizeof(std::size_t), kMost = 4096;
  const std::string where = "size " + std::to_string(given.size);
  if (given.size < kLeast || given.size > kMost || given.size % alignof(Structure) != 0)
    refuse("bad options", where, "it is that of no version", "begin with " + begin);
  const auto* const bytes = reinterpret_cast<const unsigned char*>(&given);
  for (std::size_t i = sizeof given; i < given.size; ++i)
    if (bytes[i] != 0)
      refuse("unknown option", where,
             "a member of a later version is set, and this library is version " +
                 std::to_string(SIM_MAJOR) + "." + std::to_string(SIM_MINOR),
             "leave it 0, or install the later library");
  Structure whole{};
  std::memcpy(&whole, bytes, std::min(given.size, sizeof whole));
  return whole;
}

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

// The scene of a file, or of its text. Throws Error.
std::unique_ptr<sim_scene> opened(const std::string& name, const char* text, const Asked& asked);

// The systems of the scene, which are new, ask scene.stop in long steps.
void listen(sim_scene& scene);

// Frees the scene now, or at the end of the call that it is in.
void close(sim_scene* scene) noexcept;

inline const char* checked_text(const char* text, const char* name) {
  if (!text) refuse("null text", name, "a text is wanted", "give one that ends with a zero byte");
  return text;
}

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

// Stores the current exception, and returns its code. One without a location gets the function of
// the interface as its location.
int tell(sim_error* error, const char* function) noexcept;

// Calls work(); returns the code of its exception, which never propagates.
template <class Work>
int guarded(sim_error* error, Work work, const char* function = __builtin_FUNCTION()) noexcept {
  try {
    work();
    return SIM_OK;
  } catch (...) {
    return tell(error, function);
  }
}

// The same for functions that return a pointer: null on failure.
template <class Work>
auto guarded_pointer(sim_error* error, Work work,
                     const char* function = __builtin_FUNCTION()) noexcept -> decltype(work()) {
  try {
    return work();
  } catch (...) {
    tell(error, function);
    return nullptr;
  }
}

char* given_away(const std::string& text);  // for sim_free(); throws std::bad_alloc

// Throws Error{kUsage} for an index that the scene does not have.
Simulation& system_of(sim_scene* scene, int system);
const Simulation& system_of(const sim_scene* scene, int system);

}  // namespace sim::c
