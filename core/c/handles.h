// The objects behind the handles of sim.h, and the codes of exceptions.
#pragma once

#include <atomic>
#include <cstdint>
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
#include "core/study/accuracy/error_goal.h"
#include "core/study/run/track.h"
#include "core/study/study.h"

// Members of a scene in the order in which the later ones refer to the earlier.
struct sim_scene {
  enum class State { kFree, kInCall, kToBeClosed };  // the last one at the end of the call
  mutable std::atomic<State> state = State::kFree;
  std::unique_ptr<sim::Registry> registry;
  sim::c::Asked asked;
  sim::StudiedScene loaded;
  std::shared_ptr<const char> self = std::make_shared<const char>('\0');  // snapshots know it by it
  std::uint64_t generation = 1;
  std::vector<sim::study::Verdict> verdicts;  // of the last run; empty: there was none
  std::string summary;                        // of it, JSON
  double seconds = 0;                         // that it took
  // The choices of sim_choose(), one a system or none at all, and the generation that it left.
  std::vector<std::optional<sim::study::GoalChoice>> choices;
  sim::c::ChoiceRequest chosen;
  std::uint64_t chosen_at = 1;
  // True if a field of the caller asked to stop. Steps pass on no exception but Error.
  std::shared_ptr<bool> field_stopped = std::make_shared<bool>(false);
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

// Frees the scene now, or at the end of the call that it is in.
void close(sim_scene* scene) noexcept;

inline const char* checked_text(const char* text, const char* name) {
  if (!text) refuse("null text", name, "a text is wanted", "give one that ends with a zero byte");
  return text;
}

// Calls work(); its exception becomes Stopped if a field of the scene asked for it.
template <class Work>
void stoppable(const sim_scene& scene, Work work) {
  try {
    work();
  } catch (...) {
    if (!std::exchange(*scene.field_stopped, false)) throw;
    throw Stopped();
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
