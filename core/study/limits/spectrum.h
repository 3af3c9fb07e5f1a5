// The extreme eigenvalues of the Jacobian of a system, and the location of their modes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/study/problem.h"

namespace sim::study {

// An eigenvalue lambda of J = df/dX, as the oscillator q'' = -omega^2 q - damping q'.
struct Vibration {
  double omega = 0;    // |lambda|, rad/s
  double damping = 0;  // -2 Re lambda, 1/s
};

// The decay rate of velocities by themselves, the largest eigenvalue of -da/dv, 1/s: by drag alone,
// or else by all forces, which splittings do not take exactly; 0 if there are none.
struct VelocityDecay {
  double drag = 0, forces = 0;
};

struct Spectrum {
  Vibration fastest;
  double residual = 0;  // |J u - lambda u| / |lambda u| of it
  double growth = 0;    // of the fastest growing mode, 1/s: no step size helps there; 0 = none
  double decay = 0;     // of the fastest decaying one, 1/s
  double bound = 0;     // omega is not above it while no spring is below half its rest length;
                        // infinity where nothing bounds it, or in a first-order system
  int products = 0;     // of J with a vector
  // All that were found, fastest first: in a system of particles those of q'' = -S q with the
  // damping of the fastest, and besides the eigenvalues of J, which differ for uneven damping.
  std::vector<Vibration> vibrations, rates;
  VelocityDecay velocities;
  bool first_order = false;

  // The fastest mode as a direction of X: a pair that spans its plane (displacement and velocity;
  // real and imaginary part in a first-order system, where the second one may be all zero).
  std::vector<double> shape, partner;
  std::vector<double> weights;  // of each number of X where modes are orthogonal: masses, or 1
  std::vector<std::pair<int, double>> particles;         // share of the motion, largest first
  std::vector<std::pair<std::string, double>> families;  // share of the elastic energy
};

// The spectrum at the present state of the system. Arnoldi (1951), Quart. Appl. Math. 9, 17-29,
// with full reorthogonalisation, at most `products` long: matrix-free, and exact for small systems.
// In a system of particles it works on M^-1/2 K M^-1/2, for which it is the Lanczos method.
Spectrum spectrum(Simulation& system, int products = 80);

// The fastest vibration alone, from few products of J with a vector (6 determine omega to about 0.1
// % on a cloth, and never overestimate it).
Vibration fastest_vibration(Simulation& system, int products = 6);

// The vibration that limits the steps of its integrator: the same, or the fastest mode of the part
// of f that the method takes explicitly, if that is not all of it.
Vibration limiting_vibration(Simulation& system, int products = 6);

// The displacement of each particle in the fastest mode, the largest as 1; for a flat state one
// number.
std::vector<double> fastest_mode(Simulation& system);

// The Gershgorin bound alone, by discs around the particles: no product at all.
double omega_bound(Simulation& system);

// The smallest damping rate c / m of a free particle, 1/s; 0 in a first-order system.
double smallest_damping(Simulation& system);

// The inverse mass, 1/kg, 0 for a pinned particle; of a second-order system.
double inverse_mass(Simulation& system, int particle);

VelocityDecay velocity_decay(Simulation& system, int products = 6);

// The share of each family in the elastic energy of a small displacement (3 numbers a particle).
std::vector<std::pair<std::string, double>> family_shares(const Simulation& system,
                                                          const std::vector<double>& displacement);

}  // namespace sim::study
