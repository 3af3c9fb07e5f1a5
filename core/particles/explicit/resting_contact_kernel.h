// Resting contact with a plane or a sphere through a step: many particles at a time.
#pragma once

#include <cstdint>

#include "core/geometry/primitive_surface.h"
#include "core/particles/explicit/stages.h"

namespace sim {

// A step of size h of particles near one surface: from q0, v0 to q, v.
struct RestingContactStep {
  double h = 0;                    // s
  PrimitiveSurface before, after;  // at both ends of the step
  double friction = 0, restitution = 0;
  double reach = 0;                    // m, h times the fastest that the surface may be
  double room = 0;                     // m, the change of a path that meets no other surface
  bool moves = false;                  // the surface
  bool once = false;                   // bounces, as StepPath
  bool whole = false;                  // StepPath::between() and velocities; or a drift alone
  const std::uint8_t* free = nullptr;  // a bit a particle
  const double *q0[3] = {}, *v0[3] = {};
  double *q[3] = {}, *v[3] = {};
};

// The second half of a step, after a kick: the constrained velocity and what follows from it.
struct RestingContactKick {
  PrimitiveSurface surface;
  double friction = 0;
  const double* q[3] = {};
  double* v[3] = {};
  const double* a[3] = {};  // m/s^2; null: nothing follows
  double* v_after[3] = {};  // after the kick that comes next
  Kick next = {};
  double* q_next[3] = {};  // after its drift; may be null
  double drift = 0;        // s
};

// Results for eight particles, a bit each.
struct RestingContactBlock {
  unsigned known = 0;                          // nothing is left to do for these
  unsigned met = 0;                            // of these, the particles in contact
  unsigned resting = 0;                        // as StepPath::resting
  double lost[8], given[8];                    // as ContactWork, of resolve()
  double lost_velocity[8], given_velocity[8];  // of constrain_velocity(), J/kg
};

// Computes the bits of Contacts::resolve() and constrain_velocity() for particles that rest on the
// surface at the start of the step and are pressed into it, and leaves particles unchanged that do
// not come near it.
struct RestingContactKernels {
  // Resolves the particles [begin, end), begin a multiple of 8, eight to an entry. Particles that
  // are not `known` keep their numbers.
  void (*resolve)(const RestingContactStep& step, int begin, int end, RestingContactBlock* block);
  // Constrains the velocities of the eight particles from i on that have a bit; false if they keep
  // their numbers.
  bool (*constrain_velocity)(const RestingContactKick& kick, int i, unsigned bits,
                             RestingContactBlock& block);
};
RestingContactKernels resting_contact_kernels();  // for this machine

}  // namespace sim
