// The scene stepped by sim-petsc: the part of one process.
#pragma once

#include <petscsys.h>

#include <cstdint>
#include <vector>

#include "plugins/engines/petsc_files.h"

namespace sim::petsc {

// The part of a scene that this process has: particles [begin, end) and the ends of springs there.
struct Scene {
  engine::PetscHead head{};
  PetscInt begin = 0, end = 0;
  std::vector<double> mass, x, v, k, rest;
  std::vector<std::int64_t> first, other, moments;
  std::vector<bool> moves;       // the other end
  std::vector<PetscInt> ghosts;  // particles of others that springs lead to, ascending
  std::vector<PetscInt> local;   // where the other end is: own ones first, then ghosts

  PetscInt own() const { return end - begin; }
  bool free(PetscInt i) const { return mass[static_cast<std::size_t>(i)] > 0; }
};

// Reads the scene from the file in this folder; false if it is missing or incomplete.
bool read_scene(Scene& scene, int rank, int ranks);

}  // namespace sim::petsc
