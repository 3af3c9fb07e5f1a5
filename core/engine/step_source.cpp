#include "core/engine/step_source.h"

#include <algorithm>

namespace sim::engine {

void StepSource::use(const EngineRequest& request, Registry& registry,
                     const std::function<bool()>& stop,
                     std::function<void(const std::string&)> note,
                     const std::function<MoreMoments(std::size_t system)>& more) {
  note_ = std::move(note);
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    study::Track& track = tracks_[i];
    EngineRequest own = request;
    if (scene_->world && !own.results.empty()) own.results += "/" + track.system().name();
    const std::int64_t strides[] = {track.frame_stride(), track.row_stride()};
    const int ranks = own.launch.words.empty() ? own.launch.ranks : 0;
    engines_.push_back(std::make_unique<EngineRun>(
        own, scene_->systems[i], track,
        moments_of(track, strides, ranks, more ? more(i) : MoreMoments()), registry, stop));
  }
}

void StepSource::start() {
  for (const auto& each : engines_) each->start();
}

void StepSource::perform(study::Track& track) {
  if (replays_) replays_->perform(index_of(track), track);
}

int StepSource::advance(study::Track& track, std::int64_t most) {
  const std::size_t i = index_of(track);
  if (has_engine()) {
    const bool advanced = engines_[i]->advance(track);
    if (const std::string note = engines_[i]->take_note(); !note.empty()) note_(note);
    return advanced ? 1 : 0;
  }
  if (scene_->systems[i].one_thread) most = 1;  // a function of the scene may fail in any step
  if (replays_) most = std::min(most, replays_->due(i, track.system()));
  return track.advance(most);
}

void StepSource::finish() {
  for (study::Track& each : tracks_)
    if (each.finished()) perform(each);
}

}  // namespace sim::engine
