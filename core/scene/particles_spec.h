// The particles of a scene as plain data: a grid, a list, pins.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/rigid_motion.h"
#include "core/math/vec3.h"

namespace sim {

// Particles at origin + i * du + j * dv + k * dw, (i, j, k) with the id
// first + (i * size[1] + j) * size[2] + k.
struct GridSpec {
  std::array<int, 3> size{0, 0, 1};
  Vec3 origin = Vec3::Zero(), du = Vec3::Zero(), dv = Vec3::Zero(), dw = Vec3::Zero();
  double mass = 1;     // kg, each
  int directions = 2;  // that the scene gave: 2 or 3
  int first = 0;       // id

  int count() const { return size[0] * size[1] * size[2]; }
  bool has(int id) const { return id >= first && id < first + count(); }
  std::array<int, 3> at(int id) const;  // its (i, j, k)
  // A sheet, or the boundary of a block; see grid_triangles().
  std::vector<std::array<int, 3>> triangles() const;
};

struct ParticleSpec {
  Vec3 position = Vec3::Zero();  // m
  Vec3 velocity = Vec3::Zero();  // m/s
  double mass = 1;               // kg
};

// A particle pinned to a path.
struct PrescribedSpec {
  int particle = 0;
  std::shared_ptr<const RigidMotion> path;
  SourceLocation place;
};

// Ids run over the grid first (if there is one), then over the list.
struct ParticlesSpec {
  std::optional<GridSpec> grid;
  std::vector<ParticleSpec> list;
  std::vector<int> pinned;
  std::vector<PrescribedSpec> prescribed = {};
  std::vector<double> weights = {};  // kg, of each id; 0: the mass above; empty: all 0
  std::map<std::string, std::vector<double>> numbers = {};  // that they carry, of each id
  std::vector<GridSpec> added_grids = {};                   // ascending, of particles of the list

  int count() const { return (grid ? grid->count() : 0) + static_cast<int>(list.size()); }
  ParticleSpec at(int id) const;
  const GridSpec* grid_of(int id) const;  // null: it is in none
};

}  // namespace sim
