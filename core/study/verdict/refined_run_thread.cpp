#include "core/study/verdict/refined_run_thread.h"

#include <exception>
#include <utility>

#include "core/base/thread_start.h"

namespace sim::study {

RefinedRunThread::RefinedRunThread(RefinedRun shadow, std::function<bool()> stop, Enough enough)
    : shadow_(std::move(shadow)), stop_(std::move(stop)), enough_(std::move(enough)) {
  start_thread(thread_, [this] { follow(); });
}

RefinedRunThread::~RefinedRunThread() { end(); }

void RefinedRunThread::look(const Moment& moment, std::span<const double> x) {
  {
    const std::lock_guard lock(mutex_);
    moments_.emplace_back(moment, x);
  }
  changed_.notify_one();
}

std::optional<RefinedRun> RefinedRunThread::take() {
  end();
  if (failed_) return {};
  return std::move(shadow_);
}

void RefinedRunThread::end() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void RefinedRunThread::follow() {
  for (std::size_t next = 0;; ++next) {
    std::pair<Moment, std::span<const double>> to;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return over_ || next < moments_.size(); });
      if (over_) return;
      to = moments_[next];
    }
    try {
      if (shadow_.follow(to.first, stop_) && !enough_(to.second, shadow_.path().back())) continue;
    } catch (const std::exception&) {
      failed_ = true;
    }
    return;
  }
}

}  // namespace sim::study
