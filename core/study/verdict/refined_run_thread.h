// A shadow that follows its run on a thread of its own.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/study/verdict/refined_run.h"

namespace sim::study {

class RefinedRunThread {
 public:
  // No other thread uses the system of the refined run meanwhile. `stop` ends it, from any thread.
  // Where the system gives no thread, the shadow stays at its start.
  RefinedRunThread(RefinedRun shadow, std::function<bool()> stop);
  ~RefinedRunThread();

  void look(const Moment& moment);  // the run is there

  // Ends the thread at the next moment: the shadow, which goes on from there. Not after a failure,
  // of memory say: then nothing.
  std::optional<RefinedRun> take();

 private:
  void follow();
  void end();

  RefinedRun shadow_;
  std::function<bool()> stop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Moment> moments_;  // all that were seen
  bool over_ = false, failed_ = false;
  std::thread thread_;  // last: it reads the others
};

}  // namespace sim::study
