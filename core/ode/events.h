// Events of a motion, such as impacts, for methods that end their steps there.
#pragma once

#include <array>
#include <cmath>

namespace sim {

// A step of size h from x at t:
//   begin(t, h, x);  the step, from x to x_next
//   while ((s = first(t, h, x, x_next)) < 1)  it is taken again, s times as long
//   end(t, h, x, x_next)
// The active contact states of a step, such as sliding, are part of f from begin() on.
class Events {
 public:
  virtual ~Events() = default;

  virtual void begin(double t, double h, const double* x) = 0;

  // The first event, as a share of the step; 1: none before its end.
  virtual double first(double t, double h, const double* x, const double* x_next) = 0;

  enum class Outcome { kSmooth, kImpact, kNotAllowed };
  // Applies the events at the end of the step, and projects x_next onto the allowed states. `cut`:
  // first() has been asked until it found no more; otherwise earlier events are resolved at the
  // end.
  virtual Outcome end(double t, double h, const double* x, double* x_next, bool cut) = 0;

  static constexpr double kAtEnd = 1 - 1e-9;  // of a step, beyond which a state is that of its end
  static constexpr int kTries = 12;           // of meeting one event
  static constexpr double kLonger = 1000;  // a next step at most, than one that ended at an event
  virtual void gave_up() = 0;              // there were more
  virtual void repeated() = 0;  // the step that just ended was taken before: it does not count
};

// Ends of steps at events in a row; more than so many are not worth cutting, and the rest up to the
// next state asked for is one step. Where they come ever faster, a motion comes to rest in contact:
// one uncut step of some bounces settles it, and is too short to lose events of others.
class EventSeries {
 public:
  static constexpr int kSettles = 32, kMost = 64;

  bool cuts() const { return count_ != kSettles && count_ != kMost; }             // the next step
  bool has_cut() const { return count_ != kSettles + 1 && count_ != kMost + 1; }  // the last one
  // How long the next step may be, s.
  double longest() const { return count_ == kSettles ? kBounces * last_ : HUGE_VAL; }
  // A step of this length, s, has ended, met: at an event.
  void add(bool met, double length);

  static constexpr std::size_t kMemory = 4;
  std::array<double, kMemory> memory() const { return {1.0 * count_, last_, first_, recent_}; }
  static EventSeries recalled(const double* memory);  // a new one if that is not a memory

 private:
  static constexpr double kBounces = 10;

  int count_ = 0;
  double last_ = 0, first_ = 0, recent_ = 0;  // s, of steps: the last, means of some
};

inline void EventSeries::add(bool met, double length) {
  constexpr int kFirst = 8;
  constexpr double kShare = 0.25, kFaster = 0.35;  // of a step in the mean; of the first ones
  if (!cuts()) {
    ++count_;
    last_ = length;
    return;
  }
  if (!met || count_ > kMost) *this = {};
  last_ = length;
  if (!met) return;
  if (++count_ <= kFirst) first_ += length / kFirst;
  recent_ = count_ == 1 ? length : (1 - kShare) * recent_ + kShare * length;
  if (count_ == kSettles && recent_ > kFaster * first_) count_ = kMost;
}

inline EventSeries EventSeries::recalled(const double* memory) {
  EventSeries series;
  if (!(memory[0] >= 0 && memory[0] <= kMost + 1 && memory[1] > 0)) return series;
  series.count_ = static_cast<int>(memory[0]);
  series.last_ = memory[1], series.first_ = memory[2], series.recent_ = memory[3];
  return series;
}

}  // namespace sim
