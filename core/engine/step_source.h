// The steps of a run: those of the kernel, among them the actions of a recording, or those that
// another program makes.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/engine/engine_run.h"
#include "core/report/replays.h"

namespace sim::engine {

class StepSource {
 public:
  // All outlive it; replays: null if nothing is replayed.
  StepSource(const SceneSpec& scene, std::span<study::Track> tracks, report::Replays* replays)
      : scene_(&scene), tracks_(tracks), replays_(replays) {}

  // The engine takes all steps, in one run a system, and stops at the moments that the tracks want
  // to see and at more(system), if given. note: receives what it has to say. Throws Error.
  void use(const EngineRequest& request, Registry& registry, const std::function<bool()>& stop,
           std::function<void(const std::string&)> note,
           const std::function<MoreMoments(std::size_t system)>& more = {});
  bool has_engine() const { return !engines_.empty(); }
  std::string title() const { return has_engine() ? engines_.front()->title() : ""; }
  void start();  // the runs of engines

  // Performs the actions that were recorded at the present state.
  void perform(study::Track& track);
  // Takes at most so many steps up to the next state that is due; 0: it could take none.
  int advance(study::Track& track, std::int64_t most);
  // Performs the actions that were recorded at the ends of finished tracks.
  void finish();

 private:
  std::size_t index_of(const study::Track& track) const {
    return static_cast<std::size_t>(&track - tracks_.data());
  }

  const SceneSpec* scene_;
  std::span<study::Track> tracks_;
  report::Replays* replays_;
  std::vector<std::unique_ptr<EngineRun>> engines_;  // of each track, or none
  std::function<void(const std::string&)> note_;
};

}  // namespace sim::engine
