// One case of a sweep: its measurements, and the process it runs in.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/run/judged.h"
#include "cli/run/scene.h"
#include "core/base/input_file.h"
#include "core/base/stopwatch.h"
#include "core/report/case_run.h"
#include "core/report/check.h"

namespace sim::cli {

using report::case_columns, report::lost_case, report::SweepCases;

// A run as defined by a case.
struct CaseRun {
  SceneRequest scene;
  RunLength length;
  std::optional<Checks> checks;
  bool verify = true;
  std::vector<std::string> of = {};  // figures
};

// The row of a case, and the files that were read for it.
struct CaseResult {
  std::vector<std::string> fields;
  std::vector<InputFile> inputs = {};
};

// The row of each run; `observed` are the names of quantities and figures. Errors are rows as well:
// with the exit code and the reason. Several runs are stepped side by side where that is possible,
// and their seconds are the mean; all else is as it is of each alone.
std::vector<CaseResult> measured_cases(std::span<const CaseRun> runs,
                                       const std::vector<std::string>& observed,
                                       const Environment& environment, Registry& registry);

// Runs a function in a process of its own, which ends with this one, however that ends.
class CaseProcess {
 public:
  explicit CaseProcess(const std::function<std::vector<CaseResult>()>& work);  // throws Error{kIo}
  ~CaseProcess();  // ends it if it still runs
  CaseProcess(CaseProcess&& other) noexcept;
  CaseProcess& operator=(CaseProcess&&) = delete;

  int pipe() const { return pipe_; }                   // readable when there is something to take()
  bool take();                                         // false: it has said everything
  double seconds() const { return watch_.seconds(); }  // since its start
  void end();                                          // at once
  int wait();                                          // its exit code, 128 + signal
  std::vector<CaseResult> results() const;             // after 0; none where it was cut off

 private:
  pid_t child_ = -1;
  int pipe_ = -1;
  Stopwatch watch_;
  std::string said_;
};

}  // namespace sim::cli
