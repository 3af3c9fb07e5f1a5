// The printed report of a run: the scene, rows as it goes, a progress line, how long it took.
#pragma once

#include <chrono>
#include <ostream>
#include <span>
#include <string>

#include "cli/run/judged.h"
#include "cli/run/scene.h"

namespace sim::cli {

// One line on a terminal, rewritten in place: t, steps/s, times real time, energy drift.
class Progress {
 public:
  Progress(std::ostream& err, bool on);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::span<Track> tracks);  // draws at most ten times a second
  void clear();                          // before anything else is printed

 private:
  using Clock = std::chrono::steady_clock;

  std::ostream& err_;
  bool on_, drawn_ = false;
  Clock::time_point begin_, last_;
};

class Report {
 public:
  // `out` may be null: quiet.
  Report(std::ostream* out, const LoadedScene& scene) : out_(out), scene_(scene) {}

  void header(std::span<Track> tracks, const std::string& engine = "");
  std::string columns(std::span<Track> tracks);  // the heads of the rows
  void row(Track& track);
  void footer(std::span<Track> tracks, double seconds);

 private:
  std::string measures(Track& track) const;

  std::ostream* out_;
  const LoadedScene& scene_;
  std::size_t name_width_ = 6;
};

}  // namespace sim::cli
