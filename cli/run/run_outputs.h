// The outputs of a run: each is filled and committed by itself, so that one that fails costs no
// other one.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/run/judged.h"
#include "cli/run/recorder.h"
#include "cli/run/report.h"
#include "cli/run/run.h"
#include "cli/run/run_checkpoints.h"
#include "core/output/tables.h"

namespace sim::cli {

class RunOutputs {
 public:
  // Opens all files; throws what one of them throws, and then none is left. All outlive it.
  RunOutputs(const RunRequest& request, LoadedScene& scene, Registry& registry, Console& console,
             Progress& progress);

  Recorder* recorder() { return recorder_ ? &*recorder_ : nullptr; }
  // Frames and rows of the present state where they are due. An energy that is not finite gets
  // none. Throws only what functions of the scene throw.
  void take(std::size_t system, Track& track, bool last);
  void flush_words();  // to standard output

  void look(std::span<const Track> tracks);  // between steps: a checkpoint, where it is time

  // The checkpoint first; a signal that comes during the rest skips what takes long.
  void commit_checkpoint(std::span<const Track> tracks);
  void commit_files();
  void settle(bool diverged);  // after the verification

  // Reports the exception that is being handled, and keeps its exit code.
  void fail();
  int code() const { return code_; }  // of the first failure, or 0
  // True if nobody is left to run for: all outputs have failed, or a reader has gone.
  bool deserted() const;
  void tell_written();  // after failures: the files written all the same

 private:
  template <class Use>
  bool attempt(Use use);
  template <class Table, class Use>
  void use(std::optional<Table>& table, Use use);
  template <class Table>
  void commit(std::optional<Table>& table, const std::optional<Target>& target);
  void wrote(const std::string& file);

  const RunRequest& request_;
  Console& console_;
  Progress& progress_;
  std::optional<DumpTable> dump_;
  std::optional<EnergyTable> energy_;
  std::optional<ObserveTable> observe_;
  std::optional<TensionTable> tension_;
  std::optional<Recorder> recorder_;
  std::optional<RunCheckpoints> checkpoints_;
  std::vector<std::string> written_;  // files that were replaced
  int code_ = 0;
  bool words_failed_ = false;
};

}  // namespace sim::cli
