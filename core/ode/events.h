// Events of a motion, such as impacts, for methods that end their steps there.
#pragma once

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

  // Ends of steps between two states that a method was asked for; more are not worth cutting.
  static constexpr int kMostCuts = 32;
  static constexpr int kTries = 12;        // of meeting one event
  static constexpr double kLonger = 1000;  // a next step at most, than one that ended at an event
  virtual void gave_up() = 0;              // there were more
  virtual void repeated() = 0;  // the step that just ended was taken before: it does not count
};

}  // namespace sim
