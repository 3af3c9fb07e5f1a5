// The files of --out: which moments of a run they get, and when they are written.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/scene.h"
#include "cli/run/track.h"
#include "core/output/writer.h"

namespace sim::cli {

// What of a run is kept, and how it is shown.
struct OutRequest {
  std::vector<std::string> files;
  Look look;
  std::optional<double> fps;
  std::optional<std::int64_t> every;

  bool show = false;  // in the terminal, while it runs
  bool any() const { return show || !files.empty(); }
};

// Throws Error{kUsage} for an ending that no writer knows and for two of one name; opens nothing.
void check_files(const OutRequest& request, Registry& registry);

class Recorder {
 public:
  // Throws what writers throw; then no file is left.
  Recorder(const OutRequest& request, const LoadedScene& scene, Registry& registry);
  ~Recorder();

  // Steps of a system until some file wants a frame of it, at least 1.
  std::int64_t due(std::size_t system, const Simulation& simulation) const;
  // Takes the frames that are due, and always the last one.
  void look(std::size_t system, Track& track, bool last);
  void commit(const std::function<bool()>& stop);

 private:
  struct Channel;

  std::vector<std::unique_ptr<Channel>> channels_;
  std::function<bool()> stop_;
};

}  // namespace sim::cli
