// The bar of a study on a terminal, and how Ctrl-C ends one.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/command_line/integrator_choice.h"
#include "cli/run/run.h"
#include "cli/terminal/console.h"
#include "cli/terminal/signals.h"
#include "core/base/duration_text.h"
#include "core/output/file_plan.h"
#include "core/report/study_words.h"
#include "core/study/problem.h"

namespace sim::cli {

using report::first_cell, report::judged_text, report::quantity;

class StudyProgress {
 public:
  using Clock = std::chrono::steady_clock;

  StudyProgress(ShowProgress when, const Console& console,
                std::function<Clock::time_point()> now = Clock::now)
      : now_(std::move(now)),
        err_(console.err),
        said_(when != ShowProgress::kOff),
        on_(when == ShowProgress::kOn || (when == ShowProgress::kAuto && console.err_is_terminal)) {
  }
  ~StudyProgress() { clear(); }
  StudyProgress(const StudyProgress&) = delete;
  StudyProgress& operator=(const StudyProgress&) = delete;

  // The progress callback for a study; this object outlives it.
  study::Watch watch();

  // Announces the approximate duration of the study, if it is long; watch() does so later, if it
  // takes longer.
  void announce(double seconds);

  void clear();
  int caught() const { return interrupts_.caught(); }  // the signal that ended it, or 0
  int exit_code();  // at the end: 0, or 128 + signal with a word about it

 private:
  void draw(std::string_view what, double done);
  void mention_long(std::string_view what, double done);

  std::function<Clock::time_point()> now_;
  std::ostream& err_;
  bool said_, on_, drawn_ = false;
  double told_seconds_ = 0;  // of the whole, last
  const Clock::time_point begin_ = now_();
  Clock::time_point last_{};
  Interrupts interrupts_;
};

// The integrators to study as the command line gives them. Throws Error{kUsage}.
std::vector<MethodChoice> study_choices(const std::vector<MethodChoice>& given, Registry& registry);

// The file of --svg among the files of a study. Throws Error{kUsage} for a world: one plot would be
// of several systems.
void plan_plot(const std::optional<std::string>& svg, const SceneSpec& scene, FilePlan& plan);

// One text a system on standard output: tables one below the other; JSON as it is, or in a world as
// {"systems":[...]}.
void put_studies(const std::vector<std::string>& texts, bool json, bool world, Console& console);

}  // namespace sim::cli
