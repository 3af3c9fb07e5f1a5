// Commands of the clients of a view, so that a flood from one of them leaves time for steps,
// pictures, the other clients and signals: a token bucket.
#pragma once

#include <chrono>
#include <deque>
#include <functional>

#include "core/output/view.h"

namespace sim::cli {

class CommandQueue {
 public:
  using Clock = std::chrono::steady_clock;

  // `ready`: a command may be taken now. The view outlives it.
  CommandQueue(View& view, std::function<bool()> ready,
               std::function<void(const ViewMessage&)> take);

  // Serves the view until then, and takes commands while they have used at most half of the time.
  void serve_until(Clock::time_point end);

 private:
  bool may_take();
  void take_next();

  View& view_;
  std::function<bool()> ready_;
  std::function<void(const ViewMessage&)> take_;
  std::deque<ViewMessage> waiting_;
  Clock::time_point filled_ = Clock::now();
  double allowance_ = 0;  // s
};

}  // namespace sim::cli
