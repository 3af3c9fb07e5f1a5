// The largest eigenvalue of the Jacobian of a system, by which its fastest motion is known.
#pragma once

#include "core/ode/ode_system.h"

namespace sim {

struct FastestMode {
  double rate = 0;     // |lambda|, 1/s: the angular frequency of an oscillation
  double damping = 0;  // -2 Re lambda, 1/s: gamma of an oscillator
  double growth = 0;   // the largest Re mu > 0 of all eigenvalues mu that were found, 1/s
};

// The eigenvalue of df/dX at x that is largest in magnitude, to about 1 %. By at most `products`
// products of the Jacobian with a vector; Arnoldi (1951), Quart. Appl. Math. 9, 17-29.
FastestMode fastest_mode(OdeSystem& system, double t, const double* x, int products = 40);

}  // namespace sim
