// All particles at one time, as forces and colliders see them, and the sink that sums forces.
#pragma once

#include <cmath>
#include <span>

#include "core/math/vec3.h"

namespace sim {

// Structure of arrays; n entries each, in SI units; padding lanes around them may be read.
// vx, vy, vz are null in a scene without velocities.
struct ParticleView {
  int n = 0;
  double t = 0;
  const double *x = nullptr, *y = nullptr, *z = nullptr;
  const double *vx = nullptr, *vy = nullptr, *vz = nullptr;
  const double* mass = nullptr;           // kg; infinity for a pinned particle
  std::span<const double> internal = {};  // of the force that looks: its own numbers of X

  bool free(int i) const { return mass[i] < HUGE_VAL; }
  double free_mass(int i) const { return free(i) ? mass[i] : 0; }
  Vec3 position(int i) const { return {x[i], y[i], z[i]}; }
  Vec3 velocity(int i) const { return {vx[i], vy[i], vz[i]}; }
};

// The particles [begin, end) whose force is being gathered.
struct Tile {
  int begin = 0, end = 0;
};

// The sums of forces, N, indexed by particle id.
struct ForceSink {
  double *x, *y, *z;

  void add(int i, const Vec3& force) const {
    x[i] += force.x();
    y[i] += force.y();
    z[i] += force.z();
  }
};

}  // namespace sim
