#include "core/base/thread_count_tuner.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace sim {
namespace {

constexpr double kStretch = 1e-3;  // s
constexpr int kRounds = 3;         // of which the least counts
constexpr double kEnough = 0.03;   // s, after which a trial begins no other round
constexpr double kAgain = 100;     // times as long as a trial took, until the next one
constexpr double kWorth = 1.25;    // times as fast twice the threads have to be

}  // namespace

double ThreadCountTuner::now() {
  using Seconds = std::chrono::duration<double>;
  return Seconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

ThreadCountTuner::ThreadCountTuner(ThreadPool& pool, Clock clock)
    : pool_(pool), clock_(std::move(clock)) {
  for (int size = 1; size < pool.most(); size *= 2) choices_.push_back({size});
  choices_.push_back({pool.most()});
  last_ = at_ = choices_.size() - 1;
}

// A trial looks at what was chosen, and at the choices beside it; the first one at all of them,
// behind a stretch in which memory and threads warm up.
void ThreadCountTuner::ask() {
  trying_ = true;
  first_ = chosen_ > 0 ? chosen_ - 1 : 0;
  last_ = std::min(chosen_ + 1, choices_.size() - 1);
  for (Choice& choice : choices_) choice.least = 0;
  rounds_ = 0;
  all_ = 0;
  at_ = last_;
  pool_.use(choices_[at_].size);
}

void ThreadCountTuner::look(int steps, double time) {
  spent_ += time;
  all_ += time;
  taken_ += steps;
  if (taken_ == 0 || spent_ < kStretch) return;
  const double each = spent_ / taken_;
  spent_ = 0;
  taken_ = 0;
  if (warm_) {
    double& least = choices_[at_].least;
    least = least > 0 ? std::min(least, each) : each;
    next();
  }
  warm_ = true;
}

void ThreadCountTuner::next() {
  if (at_ > first_) {
    --at_;
  } else {
    if (++rounds_ == kRounds || all_ > kEnough) return settle();
    at_ = last_;
  }
  pool_.use(choices_[at_].size);
}

void ThreadCountTuner::settle() {
  trying_ = false;
  chosen_ = pays();
  pool_.use(choices_[chosen_].size);
  left_ = kAgain * all_;
}

std::size_t ThreadCountTuner::pays() const {
  const auto cost = [&](std::size_t i) {
    return choices_[i].least * std::pow(kWorth, std::log2(choices_[i].size));
  };
  std::size_t best = first_;
  for (std::size_t i = first_ + 1; i <= last_; ++i)
    if (cost(i) < cost(best)) best = i;
  return best;
}

}  // namespace sim
