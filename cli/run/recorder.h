// The files of --out: the moments that they get, and the times of writing.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/judged.h"
#include "cli/run/scene.h"
#include "core/output/make_writer.h"
#include "core/picture/trail.h"
#include "core/study/accuracy/error_estimator.h"

namespace sim::cli {

// The frames of a run that are kept, and how they are shown.
struct OutRequest {
  std::vector<std::string> files;
  LookSpec look;  // overrides that of the scene
  std::optional<double> fps;
  std::optional<std::int64_t> every;

  bool show = false;  // in the terminal, while it runs
  bool any() const { return show || !files.empty(); }
};

// Throws Error{kUsage} for an ending of no writer; opens nothing.
void check_files(const OutRequest& request, Registry& registry);

inline constexpr double kFilmRate = 30;  // pictures a second, if nobody says otherwise

class Recorder {
 public:
  // Throws the errors of writers; then no file is left. Spec, systems and registry outlive it.
  Recorder(const OutRequest& request, LoadedScene& scene, Registry& registry);
  ~Recorder();

  // Steps of a system until some file wants a frame of it, at least 1.
  std::int64_t due(std::size_t system, const Simulation& simulation) const;
  // Tells the steps of a system up to `last` of which files want a frame.
  void moments(std::size_t system, const Simulation& simulation, std::int64_t last,
               const std::function<void(std::int64_t)>& tell) const;
  // Takes the frames that are due, and always the last one.
  void look(std::size_t system, Track& track, bool last);
  // Commits each file by itself; returns the names of those that were made.
  std::vector<std::string> commit(const std::function<bool()>& stop);

  // A file that fails gets no more frames, and this is called while its exception is handled.
  // Without it the exception passes.
  void on_failure(std::function<void()> failed) { failed_ = std::move(failed); }
  bool any() const;  // files that have not failed

 private:
  struct Channel;

  void follow(std::size_t system, Track& track);
  void measure(std::size_t system, const Simulation& simulation, Frame& frame);
  template <class Use>
  void use(Channel& channel, Use use);

  sim::Look look_;
  std::vector<std::unique_ptr<Channel>> channels_;
  std::vector<study::ErrorEstimator> companions_;  // of each system, to colour errors
  std::vector<std::vector<double>> modes_;         // of each system, to colour its fastest mode
  struct Follower {
    TrailRecorder recorder;
    std::int64_t stride = 1, taken = -1;  // steps
  };
  std::vector<Follower> followers_;  // of each system, what leaves trails
  std::function<bool()> stop_;
  std::function<void()> failed_;
};

}  // namespace sim::cli
