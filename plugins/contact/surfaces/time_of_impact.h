// Distance and time of impact of two elements of surfaces (continuous collision detection).
#pragma once

#include <array>

#include "core/math/vec3.h"

namespace sim {

// A pair of four points: vertex 0 against triangle 1 2 3, or edge 0 1 against edge 2 3.
enum class PairKind { kVertexTriangle, kEdgeEdge };
using FourPoints = std::array<Vec3, 4>;

// r = sum_k weights_k p_k leads from the nearest point of the second part to that of the first; the
// weights of each part add up to 1 and -1.
struct Separation {
  Vec3 normal;  // r / |r|
  std::array<double, 4> weights;
  // The distance bound, m: no point of one part is nearer than this to one of the other. It is the
  // least distance of their corners along the normal, hence a bound whatever the rounding of the
  // normal, and equal to |r| but for that. < 0 if no separating plane was found.
  double gap;
};

Separation separation_of(PairKind kind, const FourPoints& p);

// The time of impact of points that move on straight lines, p + s d, 0 <= s <= 1.
struct TimeOfImpact {
  bool hit = false;  // they come nearer than `gap`, or it could not be excluded
  double s = 1;      // until then they do not; 1 without a hit
  Separation then;   // at s
};

// Conservative advancement along separating planes: a step ends where the fixed plane between the
// parts would be nearer than gap / 2 to one of them. So a contact is never missed as long as gap /
// 2 is more than the rounding error of the distances; a smaller gap is raised. Mirtich (1996), Li,
// Kaufman & Jiang (2021), ACM Trans. Graph. 40(4), section 6.
// radius, m: of a ball around each point of one part, from which the gap counts.
TimeOfImpact time_of_impact(PairKind kind, const FourPoints& p, const FourPoints& d, double gap,
                            double radius = 0);

// An upper bound, m, on the relative motion of points of the two parts.
double relative_motion(PairKind kind, const FourPoints& d);

}  // namespace sim
