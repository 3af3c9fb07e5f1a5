// A refined run that follows its run on a thread of its own.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "core/study/verdict/refined_run.h"

namespace sim::study {

class RefinedRunThread {
 public:
  // True if the positions of a run and of its refined run are so far apart that no more is needed.
  using Enough = std::function<bool(std::span<const double> run, const Sight& shadow)>;

  // No other thread uses the system of the refined run meanwhile. `stop` ends it, from any thread,
  // and so does `enough`, on the thread. If the system provides no thread, the refined run stays at
  // its start.
  RefinedRunThread(RefinedRun shadow, std::function<bool()> stop, Enough enough);
  ~RefinedRunThread();

  // The run has reached this moment, at these positions, which stay.
  void look(const Moment& moment, std::span<const double> x);

  // Ends the thread at the next moment: returns the refined run, which continues from there. Empty
  // after a failure, such as one of memory.
  std::optional<RefinedRun> take();

 private:
  void follow();
  void end();

  RefinedRun shadow_;
  std::function<bool()> stop_;
  Enough enough_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::pair<Moment, std::span<const double>>> moments_;  // all that were seen
  bool over_ = false, failed_ = false;
  std::thread thread_;  // last: it reads the others
};

}  // namespace sim::study
