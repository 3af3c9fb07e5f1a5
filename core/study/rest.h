// Static equilibrium: the rest state of a damped scene.
#pragma once

#include <functional>
#include <string>

#include "core/ode/outcome.h"
#include "core/scene/simulation.h"

namespace sim::study {

struct Rest {
  bool found = false;
  double force = 0;           // N, the largest that is left on a free particle
  double in_play = 0;         // N, the largest of a single kind of force on one
  double potential = 0;       // J
  Effort effort;              // steps: of growing length, each from rest
  int broke = 0;              // springs and rods, on the way
  double t = 0;               // s, the time of the scene
  bool at_this_time = false;  // only, as forces depend on time
  std::string why, remedy;    // if it was not found
};

// Brings a scene of particles to rest at its present time: steps of backward Euler from rest, each
// longer than the one before. Each lowers the potential U by at least |dx|^2_M / 2 h^2, so that the
// scene moves as under friction, and the limit is a minimum of U, not just a state without forces
// (the proximal point method: Rockafellar 1976, SIAM J. Control Optim. 14, 877-898). Ends when
// forces are rounding errors, or 1e-10 of those in play. A scene that nothing strains is at rest
// where forces are no more than roundings of its coordinates make.
//
// If particles, bodies or surfaces may touch something that rests, or if springs or rods would
// break where forces balance, the scene takes steps of its own method instead, near their limit
// where only particles on colliders move, and all velocities become 0 whenever the kinetic energy
// has passed a peak: kinetic damping (Cundall 1976; Barnes 1999, Int. J. Space Struct. 14, 89-104).
// The force that is left on a particle is its mass times its velocity after a step from rest, over
// the step.
//
// Velocities become 0; the time stays.
// Throws Error{kUsage} for a first-order scene and one whose colliders move, and the errors of a
// stage solver.
Rest come_to_rest(Simulation& simulation, const std::function<bool()>& stop = {});

}  // namespace sim::study
