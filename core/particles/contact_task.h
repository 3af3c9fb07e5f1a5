// The task of a plugin of the kind `contact`, from which it makes a correction of steps.
#pragma once

#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "core/particles/collider.h"
#include "core/particles/rigid/rigid_body.h"
#include "core/particles/step_correction.h"

namespace sim {

class ConstraintSystem;
class Particles;
class TriangleMesh;

// The rigid bodies of a scene and the pairs that may collide.
struct BodyCollisionSpec {
  std::vector<RigidBody> bodies = {};
  std::vector<ContactMaterial> surfaces = {};  // of each
  std::vector<bool> touches = {};              // whether each does
  int singles = 0;                             // the first particles, which are no bodies'
  std::vector<bool> left_out = {};  // of these, what another correction keeps out; empty: none
  std::set<std::pair<int, int>> tied = {};    // a body and one of these: they do not touch
  std::set<std::pair<int, int>> joined = {};  // nor do these bodies, the first has less
};

// The parts that do not pass through each other: surfaces, as sim.contact lists them, or bodies.
struct ContactTask {
  Particles& particles;  // which outlive the correction
  ConstraintSystem* constraint_system =
      nullptr;  // constraints, to be obeyed at the ends of steps; null: there are none
  const double* initial = nullptr;  // the state at the start
  std::vector<std::shared_ptr<const TriangleMesh>> surfaces = {};
  BodyCollisionSpec bodies = {};
};

}  // namespace sim
