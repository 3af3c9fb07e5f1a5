// The number of threads that the steps of a run are worth, tuned by the time that they take.
#pragma once

#include <functional>
#include <vector>

#include "core/base/thread_pool.h"

namespace sim {

// The threads of a run: a fixed count, or at most that many and only as many as pay off. Results do
// not depend on it, bit for bit.
struct Threads {
  Threads(int number = 1, bool pay = false) : most(number), as_pay(pay) {}
  int most;  // at least 1
  bool as_pay;
};

// Times short stretches of steps on one member of a thread pool, on two, four .. and on all, and
// continues with as many as pay: each doubling has to save a fifth of the time. Re-tuned
// occasionally, which takes about a hundredth of the time, for scenes change, and other programs
// come and go.
class ThreadCountTuner {
 public:
  using Clock = std::function<double()>;  // s
  static double now();                    // of the machine

  explicit ThreadCountTuner(ThreadPool& pool, Clock clock = now);

  void begin() {  // steps follow
    begun_ = clock_();
  }
  void end(int steps) {  // so many were taken
    const double time = clock_() - begun_;
    if (trying_)
      look(steps, time);
    else if ((left_ -= time) <= 0)
      ask();
  }

 private:
  struct Choice {
    int size;
    double least = 0;  // s a step
  };

  void ask();  // begins a trial
  void look(int steps, double time);
  void next();  // stretch of a trial
  void settle();
  std::size_t pays() const;

  ThreadPool& pool_;
  Clock clock_;
  std::vector<Choice> choices_;
  std::size_t chosen_ = 0, first_ = 0, last_ = 0;  // the choices of a trial: first_ .. last_
  std::size_t at_ = 0;
  bool trying_ = true, warm_ = false;
  int rounds_ = 0, taken_ = 0;
  double begun_ = 0, spent_ = 0, all_ = 0;  // s: of the stretch, of the trial
  double left_ = 0;                         // s of steps up to the next trial
};

}  // namespace sim
