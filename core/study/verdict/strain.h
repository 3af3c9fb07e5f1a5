// The most stretched or compressed spring.
#pragma once

#include <cmath>
#include <string>

#include "core/study/problem.h"

namespace sim::study {

struct StrainedSpring {
  int a = -1, b = -1;  // -1: there is none with a rest length
  double strain = 0;   // length / rest - 1
};

// The worst spring at the present state; a length that is not finite counts as the worst.
StrainedSpring worst_spring(Simulation& system);

// The approach of a spring to length zero, where its force reverses at once: a spring that gets
// there without speed leaves on either side. Predicted from the present state and, on straight
// lines, `ahead` s.
struct Pinch {
  static constexpr double kNear = 0.1;  // of the rest length; longer springs are not examined

  int a = -1, b = -1;
  double share = HUGE_VAL;   // smallest length over rest length, of springs that come near
  double margin = HUGE_VAL;  // m: as little decides on which side it comes out
};
Pinch nearest_pinch(Simulation& system, double ahead);

// The family of a spring, according to the forces.
std::string family_of(const Simulation& system, int a, int b);

}  // namespace sim::study
