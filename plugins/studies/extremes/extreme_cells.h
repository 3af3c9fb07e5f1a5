// Every integrator at the extremes of stiffness, mass, step and distance from the origin: what the
// verdict says, and whether it is right.
#pragma once

#include <string>
#include <vector>

#include "core/study/verdict/verdict.h"

namespace sim::study {

// A particle let go on a vertical spring, whose motion is known: y = -1 - m g / k (1 - cos(w t)),
// w^2 = k / m; without drag.
struct ExtremeCell {
  double stiffness = 0, mass = 0, dt = 0;  // N/m, kg, s
  double offset = 0;                       // m, of all coordinates
  bool run = false;  // false: it would take too long with steps of its own, or it was refused
  Trust trust = Trust::kTrusted;
  double error = 0;    // largest distance from the exact motion over the distance moved or 1 m
  std::string reason;  // of the verdict, or why it was refused

  bool silently_wrong() const { return run && trust == Trust::kTrusted && !(error <= 0.1); }
};

struct ExtremeMap {
  Candidate method;
  std::vector<ExtremeCell> cells;  // by offset, stiffness, mass, dt
};

struct Extremes {
  std::vector<double> stiffness, mass, dt;  // of the map without an offset
  std::vector<double> offset;               // at 1000 N/m and 1 kg, over the same dt
  std::vector<ExtremeMap> maps;
  bool complete = true;  // false when told to end
};

// Over 60 steps in each cell. No choices: all integrators that fit.
Extremes extremes(Registry& registry, const std::vector<MethodChoice>& integrators,
                  const Watch& watch);

}  // namespace sim::study
