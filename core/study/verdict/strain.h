// The spring that is stretched or pressed the most.
#pragma once

#include <string>

#include "core/study/problem.h"

namespace sim::study {

struct StrainedSpring {
  int a = -1, b = -1;  // -1: there is none with a rest length
  double strain = 0;   // length / rest - 1
};

// In the present state; not a number of a length that is not finite counts as the worst.
StrainedSpring worst_spring(Simulation& system);

// Its family, asked of the forces.
std::string family_of(const Simulation& system, int a, int b);

}  // namespace sim::study
