// Constitutive laws of elastic solids: the energy of a deformation F = dx/dX, and its derivatives.
#pragma once

#include "core/math/mat3.h"

namespace sim {

inline double trace_of(const Mat3& m) { return m(0, 0) + m(1, 1) + m(2, 2); }

// Energies a volume, with C = F^T F, J = det F, cof F = dJ/dF:
//   stvk         mu E:E + lambda/2 tr(E)^2,  E = (C - 1) / 2
//   corotated    mu |F - R|^2 + lambda/2 (R:F - 3)^2,  R the rotation nearest to F
//   neo_hookean  mu/2 (tr C - 3) - mu/2 log((tr C + 1) / 4) - 3/4 mu (J - 1) + lambda/2 (J - 1)^2
// The energies of corotated and neo_hookean are finite and smooth where a cell is flat or inverted;
// for the rotation an inverted cell has its least stretch below 0. St. Venant & Kirchhoff; McAdams
// et al. (2011), Efficient elasticity for character skinning; Smith, de Goes & Kim (2018), Stable
// neo-Hookean flesh simulation, eq. 14, but for a constant.
struct ConstitutiveLaw {
  enum class Model { kNeoHookean, kCorotated, kStVk };
  Model model = Model::kNeoHookean;
  double mu = 0, lambda = 0;  // Pa
};

// The law with the small strains of Hooke's law with Young's modulus, in Pa, and Poisson's ratio:
// for neo_hookean 4/3 and lambda + 5/6 mu of Lame's constants (ibid., section 3.4).
ConstitutiveLaw solid_law(ConstitutiveLaw::Model model, double young, double poisson);

Mat3 green_strain(const Mat3& F);  // (F^T F - 1) / 2

// The derivative of the first Piola-Kirchhoff stress P = d(energy density)/dF at a deformation F.
class StressSlope {
 public:
  StressSlope(const ConstitutiveLaw& law, const Mat3& F);
  Mat3 along(const Mat3& dF) const;

 private:
  ConstitutiveLaw law_;
  Mat3 F_;
  Mat3 cofactors_;    // of neo_hookean
  Mat3 R_, inverse_;  // of corotated: (tr(S) 1 - S)^-1 with F = R S
  Mat3 S_;            // of stvk: the second stress
  double first_ = 0, second_ = 0;
};

}  // namespace sim
