// Moments at which a motion turns from one course to another, for methods that end their steps
// there.
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

  // Where the first event lies, as a share of the step; 1: nowhere before its end.
  virtual double first(double t, double h, const double* x, const double* x_next) = 0;

  enum class Outcome { kSmooth, kImpact, kNotAllowed };
  // Lets happen what happens at the end, and puts x_next among the allowed states. `cut`: first()
  // has been asked until it found no more; else what is met on the way counts as settled there.
  virtual Outcome end(double t, double h, const double* x, double* x_next, bool cut) = 0;

  // Ends of steps between two states that a method was asked for; more are not worth cutting.
  static constexpr int kMostCuts = 32;
  static constexpr int kTries = 12;        // of meeting one event
  static constexpr double kLonger = 1000;  // a next step at most, than one that ended at an event
  virtual void gave_up() = 0;              // there were more
  virtual void repeated() = 0;  // the step that just ended was taken before: it does not count
};

}  // namespace sim
