#include "cli/run/recorder.h"

#include <algorithm>
#include <deque>

#include "cli/terminal/terminal_view.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/picture/scenery.h"
#include "core/study/limits/spectrum.h"

namespace sim::cli {
void check_files(const OutRequest& request, Registry& registry) {
  for (const std::string& file : request.files) writer_of(file, registry);
}

// One file: its writer, and the frames of systems that wait for those of the others.
struct Recorder::Channel {
  std::string file;                // empty: the terminal
  std::unique_ptr<Writer> writer;  // none: it has failed
  CostEstimate pace = CostEstimate::kSteps;
  double interval = 0;      // s; 0: by steps
  std::int64_t stride = 1;  // steps
  struct System {
    std::int64_t next = 0;    // the moment it waits for
    std::int64_t taken = -1;  // step of the last frame
    std::deque<Frame> waiting;
    std::vector<std::vector<Vec3>> paths;  // since the last frame
    Frame newest;
    bool finished = false;
  };
  std::vector<System> systems;

  // The step of a moment.
  std::int64_t step_of(std::int64_t moment, const Simulation& simulation) const {
    if (pace == CostEstimate::kLast) return Track::kNever;
    if (interval == 0) return moment * stride;
    return simulation.steps_for(static_cast<double>(moment) * interval);
  }

  void take(std::size_t i, const Simulation& simulation, Frame frame, bool last) {
    System& system = systems[i];
    frame.paths = std::exchange(system.paths, {});
    // A frame may be that of several moments, where these are closer than steps.
    for (; step_of(system.next, simulation) <= frame.step; ++system.next) {
      system.waiting.push_back(frame);
      system.taken = frame.step;
      frame.paths.clear();
    }
    if (last && system.taken != frame.step) system.waiting.push_back(frame);
    system.taken = frame.step;
    system.newest = std::move(frame);
    system.newest.paths.clear();
    system.finished = last;
    pass();
  }

  // Moments of which all systems have their frame; of those that are finished, the last one.
  void pass() {
    while (true) {
      Moment moment;
      bool any = false;
      for (System& system : systems) {
        if (system.waiting.empty() && !system.finished) return;
        any = any || !system.waiting.empty();
      }
      if (!any) return;
      for (System& system : systems) {
        if (system.waiting.empty()) {
          moment.push_back(system.newest);
        } else {
          moment.push_back(std::move(system.waiting.front()));
          system.waiting.pop_front();
        }
      }
      writer->add(moment);
    }
  }
};

Recorder::Recorder(const OutRequest& request, LoadedScene& scene, Registry& registry)
    : look_(look_of(scene.spec, request.look)) {
  check_files(request, registry);
  WriterTask task;
  task.world = scene.spec.world;
  task.look = look_;
  task.stop = [this] { return stop_ && stop_(); };
  for (std::size_t i = 0; i < scene.systems.size(); ++i)
    task.models.push_back(make_model(scene.spec.systems[i], scene.systems[i]));
  // A look without its subject is refused now.
  Moment start;
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    Simulation& system = scene.systems[i];
    if (look_.colour == "error") companions_.emplace_back(scene.spec.systems[i], system, registry);
    if (look_.colour == "mode") modes_.push_back(study::fastest_mode(system));
    start.push_back(take_frame(system));
    measure(i, system, start.back());
    followers_.push_back({TrailRecorder(task.models[i], look_)});
  }
  Scenery(task.models, {&start, 1}, look_);
  for (const std::string& file : request.files) {
    task.file = file;
    task.fps = request.fps.value_or(kFilmRate);
    auto channel = std::make_unique<Channel>();
    channel->file = file;
    channel->writer = make_writer(task, registry);
    channel->pace = channel->writer->pace();
    if (request.every)
      channel->stride = *request.every;
    else if (request.fps || channel->pace == CostEstimate::kFilm)
      channel->interval = 1 / task.fps;
    channels_.push_back(std::move(channel));
  }
  if (request.show) {
    channels_.push_back(std::make_unique<Channel>());
    channels_.back()->writer = make_terminal_view(task);
    channels_.back()->pace = CostEstimate::kFilm;
    channels_.back()->interval = 1 / kShowRate;
  }
  for (const auto& channel : channels_) {
    channel->systems.resize(scene.systems.size());
    // A run that goes on begins with the first moment that is not past.
    for (std::size_t i = 0; i < scene.systems.size(); ++i)
      while (channel->step_of(channel->systems[i].next, scene.systems[i]) <
             scene.systems[i].step_count())
        ++channel->systems[i].next;
  }
}

Recorder::~Recorder() = default;

std::int64_t Recorder::due(std::size_t system, const Simulation& simulation) const {
  std::int64_t steps = Track::kNever;
  for (const auto& channel : channels_) {
    if (!channel->writer) continue;
    const std::int64_t step = channel->step_of(channel->systems[system].next, simulation);
    steps = std::min(steps, step - simulation.step_count());
  }
  if (const Follower& follower = followers_[system]; follower.recorder.any())
    steps = std::min(steps, follower.taken + follower.stride - simulation.step_count());
  return std::max<std::int64_t>(1, steps);
}

void Recorder::moments(std::size_t system, const Simulation& simulation, std::int64_t last,
                       const std::function<void(std::int64_t)>& tell) const {
  for (const auto& channel : channels_)
    for (std::int64_t moment = channel->systems[system].next;; ++moment) {
      const std::int64_t step = channel->step_of(moment, simulation);
      if (step > last) break;
      if (step >= simulation.step_count()) tell(step);
    }
}

template <class Use>
void Recorder::use(Channel& channel, Use use) {
  try {
    use();
  } catch (...) {
    if (!failed_) throw;
    channel.writer.reset();
    failed_();
  }
}

bool Recorder::any() const {
  return std::ranges::any_of(
      channels_, [](const auto& channel) { return channel->writer && !channel->file.empty(); });
}

void Recorder::follow(std::size_t system, Track& track) {
  constexpr std::int64_t kMostPoints = 50'000;  // of a path in a run
  Follower& follower = followers_[system];
  const std::int64_t step = track.system().step_count();
  if (!follower.recorder.any() || follower.taken == step) return;
  if (follower.taken < 0) follower.stride = 1 + (track.steps() - step) / kMostPoints;
  follower.taken = step;
  const auto& paths = follower.recorder.follow(track.system());
  for (const auto& channel : channels_) {
    auto& own = channel->systems[system].paths;
    own.resize(paths.size());
    for (std::size_t k = 0; k < paths.size(); ++k)
      for (const auto& [x, goes_on] : paths[k])
        if (goes_on && own[k].size() > 1)
          own[k].back() = x;
        else
          own[k].push_back(x);
  }
}

void Recorder::look(std::size_t system, Track& track, bool last) {
  const Simulation& simulation = track.system();
  last = last || track.finished();
  follow(system, track);
  std::optional<Frame> frame;
  for (const auto& channel : channels_) {
    if (!channel->writer) continue;
    if (!last &&
        channel->step_of(channel->systems[system].next, simulation) > simulation.step_count())
      continue;
    if (!frame) {
      frame = take_frame(simulation);
      measure(system, simulation, *frame);
      if (simulation.second_order() && track.energy_is_finite()) {
        frame->kinetic = track.energy().kinetic;
        frame->potential = track.energy().potential;
        frame->work = track.work();
        frame->drift = track.drift();
      }
    }
    use(*channel, [&] { channel->take(system, simulation, *frame, last); });
  }
}

// Records quantities besides the state that colours show.
void Recorder::measure(std::size_t system, const Simulation& simulation, Frame& frame) {
  if (!companions_.empty()) frame.values = companions_[system].errors(simulation);
  if (!modes_.empty()) frame.values = modes_[system];
}

std::vector<std::string> Recorder::commit(const std::function<bool()>& stop) {
  stop_ = stop;
  std::vector<std::string> made;
  for (const auto& channel : channels_) {
    if (!channel->writer) continue;
    use(*channel, [&] {
      channel->writer->commit();
      if (!channel->file.empty()) made.push_back(channel->file);
    });
  }
  return made;
}

}  // namespace sim::cli
