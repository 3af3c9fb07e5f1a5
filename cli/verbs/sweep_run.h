// One case of a sweep: what is measured of it, and the process it runs in.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/check.h"
#include "cli/run/judged.h"
#include "cli/run/scene.h"
#include "core/base/input_file.h"

namespace sim::cli {

// A run as a case says it.
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

// The columns of a case behind its values and before what the scene observes, and the last one.
const std::vector<std::string>& case_columns();

// The fields of these columns; `observed` are the names of quantities and figures. Errors are rows
// as well: with the exit code and the reason.
CaseResult measured_case(const CaseRun& run, const std::vector<std::string>& observed,
                         const Environment& environment, Registry& registry);

// The fields of a case that ended otherwise: killed, out of time.
std::vector<std::string> lost_case(int exit, const std::string& reason, std::size_t observed);

// A function in a process of its own, which ends with this one, however that ends.
class CaseProcess {
 public:
  using Clock = std::chrono::steady_clock;

  explicit CaseProcess(const std::function<CaseResult()>& work);  // throws Error{kIo}
  ~CaseProcess();                                                 // ends it if it still runs
  CaseProcess(CaseProcess&& other) noexcept;
  CaseProcess& operator=(CaseProcess&&) = delete;

  int pipe() const { return pipe_; }  // readable when there is something to take()
  bool take();                        // false: it has said everything
  double seconds() const;             // since its start
  void end();                         // at once
  int wait();                         // its exit code, 128 + signal
  CaseResult result() const;          // without fields where it said too little

 private:
  pid_t child_ = -1;
  int pipe_ = -1;
  Clock::time_point begin_;
  std::string said_;
};

}  // namespace sim::cli
