// Distances between the two ends of many pairs at once.
#pragma once

#include <cmath>

#include "core/particles/force.h"
#include "core/particles/springs/springs.h"

namespace sim {

// The distances of a block of pairs; arrays may be read up to the next multiple of 8.
struct Distances {
  static constexpr int kMost = 128;

  alignas(64) double d[3][kMost], r[kMost];

  void take(int lane, const Vec3& difference) {
    for (int axis = 0; axis < 3; ++axis) d[axis][lane] = difference[axis];
  }
  Vec3 at(int lane) const { return {d[0][lane], d[1][lane], d[2][lane]}; }

  void measure(int count) {
    const int lanes = (count + 7) / 8 * 8;
    for (int lane = count; lane < lanes; ++lane) take(lane, Vec3(1, 0, 0));
    double least = 1, most = 1;
    for (int lane = 0; lane < lanes; ++lane) {
      const double square =
          d[0][lane] * d[0][lane] + d[1][lane] * d[1][lane] + d[2][lane] * d[2][lane];
      least = square < least ? square : least;
      most = square > most ? square : most;
      r[lane] = std::sqrt(square);
    }
    if (least > kSafeLeast && most < kSafeMost) return;
    for (int lane = 0; lane < lanes; ++lane) r[lane] = length(at(lane));
  }

  // U'(r) / r, but 0 if there is no direction and U' is finite.
  double factor(int lane, double slope) const { return r[lane] > 0 ? slope / r[lane] : 0 * slope; }

  // d^2 U / dx dx = U'' u u^T + U'/r (1 - u u^T) with u = d/r; U'' in all directions for r = 0.
  Mat3 curvature(int lane, double slope, double second) const {
    if (r[lane] == 0) return second * Mat3::Identity();
    const Vec3 u = at(lane) / r[lane];
    const double across = slope / r[lane];
    return across * Mat3::Identity() + (second - across) * outer(u, u);
  }
};

}  // namespace sim
