// The motion of a gap within a step.
#pragma once

namespace sim {

// The time, s, before the end of a step of h at which a gap closed that is `gap` at the end, has
// the rate `rate` there and the acceleration a: gap - rate s + a s^2 / 2 = 0.
double time_since(double gap, double rate, double a, double h);

// A gap s before the end of the step is g - v s + a s^2 / 2, with g and v those at the end.
struct Approach {
  double gap = 0, rate = 0, acceleration = 0;  // m, m/s, m/s^2
  double tiny = 0, least = 0, shortest = 0;    // m; m/s: a slower approach is none; s, of a flight

  double gap_at(double s) const { return gap - (rate - 0.5 * acceleration * s) * s; }
  // The time, s, before the end of the step of the next impact, at most `now`; negative: none.
  double next_touch(double now) const;
};

}  // namespace sim
