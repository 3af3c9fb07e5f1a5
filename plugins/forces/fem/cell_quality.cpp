#include <algorithm>
#include <cmath>
#include <numbers>

#include "fem_forces.h"

namespace sim {
namespace {

double determinant_of(const Mat3& m) { return m.column(0).dot(m.column(1).cross(m.column(2))); }

double square_of(const Mat3& m) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += m.column(k).squaredNorm();
  return sum;
}

// The smallest and the largest eigenvalue of a symmetric matrix: q + 2 p cos(phi + 2 k pi / 3) with
// the third of the angle whose cosine is det((M - q) / p) / 2 (Smith (1961), Commun. ACM 4, 168).
std::pair<double, double> extreme_eigenvalues(const Mat3& m) {
  const double q = trace_of(m) / 3;
  const Mat3 off = m - q * Mat3::Identity();
  const double p = std::sqrt(square_of(off) / 6);
  if (!(p > 0)) return {q, q};
  const double phi = std::acos(std::clamp(0.5 * determinant_of(off / p), -1.0, 1.0)) / 3;
  return {q + 2 * p * std::cos(phi + 2 * std::numbers::pi / 3), q + 2 * p * std::cos(phi)};
}

}  // namespace

CellQuality FemForces::quality(const ParticleView& view) const {
  CellQuality found;
  found.cells = cell_count();
  std::vector<Mat3> strains, means(static_cast<std::size_t>(end_ - begin_));
  std::vector<double> weights(means.size(), 0.0);
  const auto place_of = [&](int cell, int node) {
    return static_cast<std::size_t>(ids_[static_cast<std::size_t>(cell * nodes_ + node)] - begin_);
  };
  for (int cell = 0; cell < cell_count(); ++cell) {
    Mat3 mean;
    double volume = 0, least_volume = HUGE_VAL;
    for (int point = 0; point < points_; ++point) {
      const Mat3 F = deformation(view, cell, point), E = green_strain(F);
      const auto [low, high] = extreme_eigenvalues(E);
      const double a = std::sqrt(std::fmax(0.0, 1 + 2 * high)),
                   b = std::sqrt(std::fmax(0.0, 1 + 2 * low));
      found.most = std::fmax(found.most, a);
      found.least = std::fmin(found.least, b);
      found.angle = std::fmax(found.angle, shear_angle(a, b));
      least_volume = std::fmin(least_volume, determinant_of(F));
      mean += weight(cell, point) * E;
      volume += weight(cell, point);
    }
    if (least_volume < 0) ++found.inverted;
    if (found.smallest < 0 || least_volume < found.volume) {
      found.smallest = cell;
      found.volume = least_volume;
    }
    for (int node = 0; node < 4; ++node) {
      const std::size_t at = place_of(cell, node);
      means[at] += mean;
      weights[at] += volume;
    }
    strains.push_back(mean / volume);
  }
  // The difference from the mean around a corner estimates the error of the mesh (Zienkiewicz & Zhu
  // (1987), Int. J. Numer. Methods Eng. 24, 337-357).
  for (int cell = 0; cell < cell_count(); ++cell)
    for (int node = 0; node < 4; ++node) {
      const std::size_t at = place_of(cell, node);
      const double jump =
          std::sqrt(square_of(strains[static_cast<std::size_t>(cell)] - means[at] / weights[at]));
      if (jump > found.strain_jump) {
        found.strain_jump = jump;
        found.jumps = cell;
      }
    }
  return found;
}

}  // namespace sim
