// The checkpoint of a run: written now and then while it goes, and at its end.
#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cli/run/checkpoint_file.h"
#include "cli/run/judged.h"
#include "cli/run/report.h"
#include "cli/run/run.h"

namespace sim::cli {

// The names beside a checkpoint: of the file that stood there before the run, and of the last state
// of a run that diverged. None where the checkpoint goes to a device or a pipe.
std::vector<std::string> names_beside_checkpoint(const std::string& file);

class RunCheckpoints {
 public:
  // For a request with a checkpoint; all arguments outlive it.
  RunCheckpoints(const RunRequest& request, LoadedScene& scene, Console& console,
                 Progress& progress);

  // Between steps, and before the first: writes the file where it is time. A failure is a warning,
  // for there will be another time.
  void look(std::span<const Track> tracks);

  // At the end. When a run diverged, its last state is written beside the file, and the last good
  // state to the file. Throws Error{kIo}.
  void keep_diverged(std::span<const Track> tracks);
  void commit(std::span<const Track> tracks);
  // Keeps the last state under its own name, once a verification has shown that the run did not
  // diverge.
  void settle(bool diverged);

 private:
  using Clock = std::chrono::steady_clock;

  void keep_good(std::span<const Track> tracks);
  void commit_good();
  void write(const std::vector<Account>& accounts);
  void keep_previous();

  const RunRequest& request_;
  LoadedScene& scene_;
  Console& console_;
  Progress& progress_;
  std::string file_, previous_, diverged_;  // the last two empty for a device or a pipe
  Clock::duration interval_;
  Clock::time_point next_;
  // The last good state, in a file without a name.
  std::unique_ptr<Output> good_;
  double good_t_ = 0;                       // s
  Clock::time_point begin_ = Clock::now();  // of the run
  Clock::duration spent_{}, last_{};        // on good states in all, on the last one
  bool replaced_ = false, is_diverged_ = false;
};

}  // namespace sim::cli
