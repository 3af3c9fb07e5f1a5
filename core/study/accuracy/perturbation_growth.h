// The growth of perturbations: the effect of a rounding error at the start.
#pragma once

#include <vector>

#include "core/study/accuracy/reference.h"

namespace sim::study {

struct PerturbationGrowth {
  std::vector<double> mean, most;  // at k time / kIntervals: distance to the undisturbed run over
                                   // the distance at the start, rms, of all runs
  bool complete = true;
};

// 8 runs from positions with normally distributed random perturbations of 1e-8 of the scene's size;
// with the reference's method at a step that is accurate to about 1e-6.
PerturbationGrowth growth(const Problem& problem, const Reference& reference, double time,
                          const Watch& watch);

// The limit of double precision: about 1e-13 of the scene's size at the start, grown.
inline constexpr double kRoundingSeed = 1e-13;

// x := the present state with every free coordinate, or number, moved by so much times a normally
// distributed number, which is the same in every program.
void disturb(Simulation& system, double size, std::uint64_t run, std::span<double> x);

}  // namespace sim::study
