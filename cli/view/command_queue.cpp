#include "cli/view/command_queue.h"

#include <algorithm>
#include <utility>

namespace sim::cli {
namespace {

constexpr double kShare = 0.5;    // of the time, for commands
constexpr double kBurst = 0.025;  // s, at once

double seconds_between(CommandQueue::Clock::time_point from, CommandQueue::Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

CommandQueue::CommandQueue(View& view, std::function<bool()> ready,
                           std::function<void(const ViewMessage&)> take)
    : view_(view), ready_(std::move(ready)), take_(std::move(take)) {}

bool CommandQueue::may_take() {
  const auto now = Clock::now();
  allowance_ = std::min(kBurst, allowance_ + kShare * seconds_between(filled_, now));
  filled_ = now;
  return allowance_ > 0 && ready_();
}

void CommandQueue::take_next() {
  const ViewMessage command = std::move(waiting_.front());
  waiting_.pop_front();
  const auto begin = Clock::now();
  take_(command);
  allowance_ -= seconds_between(begin, Clock::now());
}

void CommandQueue::serve_until(Clock::time_point end) {
  do {
    const bool take = may_take();
    view_.hold(!take || !waiting_.empty());
    const double left = take && !waiting_.empty() ? 0 : seconds_between(Clock::now(), end);
    for (ViewMessage& each : view_.wait(static_cast<int>(std::max(0.0, 1000 * left))))
      waiting_.push_back(std::move(each));
    while (!waiting_.empty() && may_take()) take_next();
  } while (Clock::now() < end && !view_.closed());
}

}  // namespace sim::cli
