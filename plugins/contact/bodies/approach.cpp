#include "approach.h"

#include <algorithm>
#include <cmath>

namespace sim {

double time_since(double gap, double rate, double a, double h) {
  const double square = rate * rate - 2 * a * gap;
  const double q = 0.5 * (rate + std::copysign(std::sqrt(std::max(0.0, square)), rate));
  double best = h;
  for (const double s : {q != 0 ? gap / q : h, a != 0 ? 2 * q / a : h})
    if (s >= 0 && s < best) best = s;
  return best;
}

// A pair that has just bounced may come back.
double Approach::next_touch(double now) const {
  double s = now;
  const bool apart = gap_at(now) > tiny, leaves = !apart && rate - acceleration * now > least;
  if (apart || leaves) {
    if (!(gap < 0)) return -1;
    s = time_since(gap, rate, acceleration, now);
    if (leaves && !(now - s > shortest)) return -1;
  } else if (gap > tiny) {
    return -1;
  }
  return rate - acceleration * s < -least ? s : -1;
}

}  // namespace sim
