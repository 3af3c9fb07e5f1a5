#include "constitutive_law.h"

#include <cmath>

namespace sim {
namespace {

Vec3 row_of(const Mat3& m, std::size_t i) { return {m(i, 0), m(i, 1), m(i, 2)}; }

// A:B, the sum of the products of their entries.
double contracted(const Mat3& a, const Mat3& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += row_of(a, i).dot(row_of(b, i));
  return sum;
}

// The rows of cof F. It is quadratic: the polar form gives its derivative.
Mat3 cofactors_of(const Mat3& F) {
  const Vec3 a = row_of(F, 0), b = row_of(F, 1), c = row_of(F, 2);
  return {b.cross(c), c.cross(a), a.cross(b)};
}
Mat3 cofactors_along(const Mat3& F, const Mat3& dF) {
  const Vec3 a = row_of(F, 0), b = row_of(F, 1), c = row_of(F, 2);
  const Vec3 da = row_of(dF, 0), db = row_of(dF, 1), dc = row_of(dF, 2);
  return {db.cross(c) + b.cross(dc), dc.cross(a) + c.cross(da), da.cross(b) + a.cross(db)};
}

// R of F = R S, and 1 where it jumps; the kernel says how.
Mat3 rotation_of(const Mat3& F) {
  const Mat3 C = transposed(F) * F, cofactors = cofactors_of(F);
  const double I = trace_of(C), J = row_of(F, 0).dot(row_of(cofactors, 0)),
               rest = 2 * contracted(C, C) - I * I;
  double L = std::sqrt(3 * I);
  for (int i = 0; i < 40; ++i) {
    const double q = L * L, slope = (4 * q - 4 * I) * L - 8 * J;
    if (!(slope > 0)) break;
    const double n = (((q - 2 * I) * L - 8 * J) * L + rest) / slope;
    const double b = n * (6 * q - 2 * I) / slope;
    L -= n + n * b;
    if (!(b * b * n > 0x1p-54 * L)) break;
  }
  const double below = (L * L - I) * L - 2 * J;
  if (!(below > 1e-12 * I * L)) return Mat3::Identity();
  return ((L * L + I) * F + 2 * L * cofactors - 2.0 * (F * C)) / below;
}

}  // namespace

Mat3 green_strain(const Mat3& F) { return 0.5 * (transposed(F) * F - Mat3::Identity()); }

ConstitutiveLaw solid_law(ConstitutiveLaw::Model model, double young, double poisson) {
  const double mu = young / (2 * (1 + poisson));
  const double lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
  if (model != ConstitutiveLaw::Model::kNeoHookean) return {model, mu, lambda};
  return {model, 4 * mu / 3, lambda + 5 * mu / 6};
}

StressSlope::StressSlope(const ConstitutiveLaw& law, const Mat3& F) : law_(law), F_(F) {
  switch (law.model) {
    case ConstitutiveLaw::Model::kStVk: {
      const Mat3 E = green_strain(F);
      S_ = 2 * law.mu * E + law.lambda * trace_of(E) * Mat3::Identity();
      return;
    }
    case ConstitutiveLaw::Model::kCorotated: {
      R_ = rotation_of(F);
      const Mat3 S = transposed(R_) * F;
      const Mat3 G = trace_of(S) * Mat3::Identity() - 0.5 * (S + transposed(S));
      const Mat3 cofactors = cofactors_of(G);
      const double determinant = row_of(G, 0).dot(row_of(cofactors, 0)), size = contracted(G, G);
      if (std::fabs(determinant) > 1e-12 * size * std::sqrt(size))
        inverse_ = cofactors / determinant;  // symmetric
      first_ = contracted(R_, F - R_);
      return;
    }
    default:
      cofactors_ = cofactors_of(F);
      first_ = contracted(F, F) + 1;
      second_ = law.lambda * (row_of(F, 0).dot(row_of(cofactors_, 0)) - 1) - 0.75 * law.mu;
  }
}

Mat3 StressSlope::along(const Mat3& dF) const {
  switch (law_.model) {
    case ConstitutiveLaw::Model::kStVk: {
      const Mat3 half = transposed(F_) * dF, dE = 0.5 * (half + transposed(half));
      return dF * S_ + F_ * (2 * law_.mu * dE + law_.lambda * trace_of(dE) * Mat3::Identity());
    }
    case ConstitutiveLaw::Model::kCorotated: {
      // dF = R W S + R dS with W = cross_matrix(w): of M = R^T dF, (tr(S) 1 - S) w = axis of M -
      // M^T.
      const Mat3 M = transposed(R_) * dF;
      const Vec3 w = inverse_ * Vec3(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
      const Mat3 dR = R_ * cross_matrix(w);
      return 2 * law_.mu * (dF - dR) + law_.lambda * contracted(R_, dF) * R_ +
             law_.lambda * first_ * dR;
    }
    default:
      return law_.mu * (1 - 1 / first_) * dF +
             (2 * law_.mu * contracted(F_, dF) / (first_ * first_)) * F_ +
             law_.lambda * contracted(cofactors_, dF) * cofactors_ +
             second_ * cofactors_along(F_, dF);
  }
}

}  // namespace sim
