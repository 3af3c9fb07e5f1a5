// The law of a weakly compressible fluid of smoothed particles.
#pragma once

namespace sim {

// Densities are counted in units of the density at rest, and by numbers of particles: each takes
// the volume V at rest, whatever its mass. With the kernel C2 of Wendland (1995),
//   w(q) = (1 - q/2)^4 (2 q + 1) for q = r/h < 2, else 0,      n_i = scale sum_j w(r_ij/h), i too,
// where scale makes n exactly 1 in a cubic lattice of cells V. The energy is that of Tait's
// equation, p = B (n^7 - 1), B = rho c^2/7, where the fluid is denser than at rest, and 0
// elsewhere, for a fluid can be torn:
//   U = sum of V e(n_i),  e(n) = B ((n^6 - 1)/6 + 1/n - 1),  e'(n) = p/n^2,     f_i = -dU/dx_i
// Monaghan (1994), J. Comput. Phys. 110, 399-406; densities by numbers: Hu & Adams (2006), J.
// Comput. Phys. 213, 844-861. Viscosity, antisymmetric and along d = x_i - x_j, keeps momentum and
// turning momentum (Monaghan (2005), Rep. Prog. Phys. 68, 1703-1759, section 4.2):
//   f_i = -mu friction sum_j (1 - q/2)^3 (v_ij.d)/(r^2 + h^2/100) d
// where friction makes it mu V times the second derivative of a shear in that lattice, in the mean
// over all directions. Surface tension is a potential of pairs that draws neighbours together and
// holds those nearer than a lattice's apart,
//   A (9/8 u^4 - u^3),  u = 1 - r/2h,  after Tartakovsky & Meakin (2005), Phys. Rev. E 72, 026301
// A from the energy of the pairs that a plane cuts (Fowler (1937), Proc. R. Soc. A 159, 229-246):
//   sigma = -pi/(2 V^2) int r^3 U dr in space, -1/V^2 int r^2 U dr in the plane.
struct FluidLaw {
  int dimensions = 3;    // 2: in a plane, for 1 m of depth
  double volume = 0;     // V: m^3, or m^2
  double smoothing = 0;  // h, m
  double scale = 0;
  double friction = 0;   // m, or 1
  double stiffness = 0;  // B, Pa
  double viscosity = 0;  // mu, Pa s
  double cohesion = 0;   // A, J
};

// In smoothing lengths: the skin of neighbour lists, for speed alone; and the search distance of
// walls, as images in reach have g_i + g_j < 2 h.
inline constexpr double kFluidSkin = 0.2, kFluidSeen = 2.01;

// The edge of a cubic cell of this volume, m.
double fluid_spacing(double volume, int dimensions);
// Sets scale and friction from smoothing, volume and dimensions.
void fit_to_lattice(FluidLaw& law);

// A of a surface tension in N/m.
double fluid_cohesion(const FluidLaw& law, double tension);

inline double fluid_pressure(const FluidLaw& law, double n) {  // Pa
  return n > 1 ? law.stiffness * (n * n * n * (n * n * n) * n - 1) : 0;
}
inline double fluid_energy(const FluidLaw& law, double n) {  // e, J/m^3
  return n > 1 ? law.stiffness * ((n * n * n * (n * n * n) - 1) / 6 + 1 / n - 1) : 0;
}

}  // namespace sim
