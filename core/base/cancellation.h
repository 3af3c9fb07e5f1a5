// A step that may be given up on the way: its thread asks now and then, and its team hears it.
#pragma once

#include <atomic>
#include <functional>
#include <utility>

namespace sim {

class Cancellation {
 public:
  // stop() is asked by threads that compute; true asks for an end, and stays true.
  void when(std::function<bool()> stop) { stop_ = std::move(stop); }
  bool requested() const { return stop_ && stop_(); }

  // The time of a step, whose result is worth nothing once it is given up. Outside of it nothing
  // is given up.
  class Step {
   public:
    explicit Step(Cancellation& of) : of_(of) { of_.active_ = true; }
    ~Step() {
      of_.active_ = false;
      of_.given_up_.store(false, std::memory_order_relaxed);
    }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;

   private:
    Cancellation& of_;
  };

  // On the thread that takes the step: asks, and true from the first request on.
  bool gives_up() {
    if (!active_ || !stop_) return false;
    if (!given_up() && stop_()) given_up_.store(true, std::memory_order_relaxed);
    return given_up();
  }
  // The same without asking, on any thread.
  bool given_up() const { return given_up_.load(std::memory_order_relaxed); }

 private:
  std::function<bool()> stop_;
  bool active_ = false;
  std::atomic<bool> given_up_ = false;
};

}  // namespace sim
