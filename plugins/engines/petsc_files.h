// The files that sim and sim-petsc exchange in a folder. It needs neither the kernel nor PETSc.
#pragma once

#include <cstdint>

namespace sim::engine {

inline constexpr const char* kPetscScene = "scene.petsc";
inline constexpr const char* kPetscFrames = "frames.bin";
inline constexpr const char* kPetscLog = "petsc.log";
inline constexpr char kPetscMagic[9] = "simpetsc";

enum class PetscMethod : std::int64_t { kRk4, kImplicitEuler, kImplicitMidpoint, kTrBdf2 };

// The head of kPetscScene, in the numbers of this machine. Behind it stand, for n particles in the
// order of places and E ends of springs:
//   int64 first[n + 1]      the ends at particle i are first[i] to first[i + 1]
//   double mass[n]          kg, 0 where pinned
//   double x[3 n], v[3 n]   m, m/s
//   double k[E], rest[E]    N/m, m
//   int64 other[E]          the particle at the other end; -1 - i where i is pinned
//   int64 moments[]         steps of which there will be a frame, ascending
struct PetscHead {
  char magic[8];
  std::int64_t n, ends, moments, start;  // start: the step of x and v
  PetscMethod method;
  double h, drag, gravity[3], tolerance;  // s, kg/s, m/s^2; of residuals, relative
  std::int64_t exact_steps;               // the first of them, solved to roundings
};

// A frame of kPetscFrames: x y z vx vy vz of each particle, in the same order, and then, once all
// of them are there, the step as int64.
inline constexpr int kPetscColumns = 6;

}  // namespace sim::engine
