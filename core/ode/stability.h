// Linear stability: the amplification of a damped oscillator in one step, and the stable step size.
#pragma once

#include <complex>
#include <functional>

#include "core/ode/plan.h"

namespace sim {

class Integrator;

// The eigenvalues z = h lambda of q'' = -omega^2 q - gamma q':
//   z = -h gamma / 2 +- sqrt((h gamma)^2 / 4 - (h omega)^2)
struct OscillatorPair {
  std::complex<double> fast, slow;  // |fast| >= |slow|
};
OscillatorPair oscillator_eigenvalues(double h_omega, double h_gamma);

// R(z) = 1 + z b^T (1 - z A)^-1 1, by its stages. Hairer & Wanner (1996), Solving ODEs II, IV.2.
std::complex<double> stability_function(const ExplicitPlan& plan, std::complex<double> z);

// Spectral radius of one step on the oscillator: of R at both eigenvalues, and of the product of
// the drifts and kicks as 2 x 2 matrices.
double amplification(const ExplicitPlan& plan, double h_omega, double h_gamma);
double amplification(const SplitPlan& plan, double h_omega, double h_gamma,
                     bool midpoint_kicks = false);

// An amplification factor, see Integrator::amplification.
using Amplification = std::function<double(double h_omega, double h_gamma)>;

// The largest h such that every step of at most h has a radius <= 1; 0 if there is none, infinity
// if there is no bound, not a number if the radius is not known. omega in rad/s, gamma in 1/s.
double stable_step(const Amplification& radius, double omega, double gamma);
double stable_step(const Integrator& integrator, double omega, double gamma);

}  // namespace sim
