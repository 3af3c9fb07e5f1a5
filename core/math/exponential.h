// e^-x from sums and products alone, so that it has the same bits on every machine.
#pragma once

#include <cmath>

namespace sim {

// Over a time tau, v' = a - gamma v takes v to keep * v + gain * a.
struct Damping {
  double keep, gain;  // e^(-gamma tau),  (1 - e^(-gamma tau)) / gamma
};

// For any finite gamma and tau, of either sign. Relative error some 1e-15, times 1 + |gamma tau|.
inline Damping damping(double gamma, double tau) {
  // phi(x) = (1 - e^-x) / x by its Taylor series for |x| <= 1/8, then e^-x = 1 - x phi(x) and
  // phi(2x) = phi(x) (1 + e^-x) / 2 as often as it takes.
  double x = gamma * tau;
  int halvings = 0;
  for (; std::fabs(x) > 0.125 && halvings < 1100; ++halvings) x *= 0.5;
  double phi = 0;
  for (int n = 14; n >= 1; --n) phi = 1 - phi * (x / (n + 1));
  double keep = 1 - x * phi;
  for (; halvings > 0; --halvings) {
    phi *= 0.5 * (1 + keep);
    keep *= keep;
  }
  return {keep, tau * phi};
}

}  // namespace sim
