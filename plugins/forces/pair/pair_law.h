// The energy of two particles as a function of their distance.
#pragma once

namespace sim {

// U(r) for r < cutoff and 0 beyond; the force on particle i is -U'(r) d / r, d = x_i - x_j.
//   Lennard-Jones  4 strength ((length / r)^12 - (length / r)^6)          Jones (1924)
//   soft           1/2 strength (length - r)^2, with cutoff = length
//   Morse          strength (e^2 - 2 e), e = exp(-rate (r - length))      Morse (1929)
// less energy_shift + slope_shift (r - cutoff). Where r = 0 there is no direction and no force; the
// infinite energy of Lennard-Jones is left out there.
struct PairLaw {
  enum class Kind { kLennardJones, kSoft, kMorse };
  Kind kind = Kind::kLennardJones;
  double strength = 0;                       // J; N/m if soft
  double length = 0;                         // m
  double rate = 0;                           // 1/m
  double cutoff = 0;                         // m
  double energy_shift = 0, slope_shift = 0;  // J, N
};

// The terms at a distance r: U in J, g = -U'(r) / r in N/m, and dg/d(r^2) in N/m^3.
struct PairTerms {
  double u[8], g[8], dg[8];
};

}  // namespace sim
