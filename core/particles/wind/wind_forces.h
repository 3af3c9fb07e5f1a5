// Wind on a surface: the force of the air on each triangle, a third of it on each corner.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/array.h"
#include "core/base/team.h"
#include "core/particles/elements/incidence.h"
#include "core/particles/elements/triangle_mesh.h"
#include "core/particles/wind/air.h"

namespace sim {

// With w = velocity of the air at the middle of a triangle - mean velocity of its corners, area A
// and unit normal n, w_t = w - (w.n) n:
//   quadratic  F = rho/2 A (cn |w.n| (w.n) n + ct |w_t| w_t)
//   linear     F = A (cn (w.n) n + ct w_t)
// Either side of a triangle will do. One without area feels nothing.
// Wejchert & Haumann (1991); Keckeisen et al. (2004).
struct WindLaw {
  bool linear = false;
  double normal = 0, tangential = 0;  // rho/2 cn and rho/2 ct in kg/m^3; linear: cn, ct in Pa s/m
};

// A third of the force on a triangle, and of its derivatives.
struct WindOnTriangle {
  Vec3 force;                       // N, on each corner
  std::array<Mat3, 3> by_position;  // of each corner, N/m
  Mat3 by_velocity;                 // of any corner, N s/m
};
WindOnTriangle wind_on_triangle(const WindLaw& law, const AirNow& air, const std::array<Vec3, 3>& x,
                                const std::array<Vec3, 3>& v);

// Triangles a, a + b, a + c for the bits a, as grids have them.
struct TriangleRun {
  std::int64_t b = 0, c = 0;
  std::vector<std::uint8_t> bits;  // of the first corner, eight to an entry
  Array third;                     // x, y, z of a third of each force, one after the other, padded
};

struct WindKernels {
  // third := those of the triangles with a first corner in [begin, end), multiples of 8 but for the
  // last; 0 where there is none. `stride`: from x to y.
  void (*run)(const WindLaw& law, const AirNow& air, const ParticleView& view,
              const TriangleRun& run, int begin, int end, double* third, std::size_t stride);
  // Likewise of any triangles, three ids each.
  void (*any)(const WindLaw& law, const AirNow& air, const ParticleView& view, const int* ids,
              int begin, int end, double* third, std::size_t stride);
  // sink += what a run gives to the particles of a tile.
  void (*add)(const TriangleRun& run, const double* third, std::size_t stride, Tile tile,
              ForceSink sink);
};
WindKernels wind_kernels();  // for this machine

class WindForces {
 public:
  WindForces(const WindLaw& law, const TriangleMesh& surface);

  void prepare(const AirNow& air, const ParticleView& view, Team& team);
  void add(Tile tile, ForceSink sink) const;

 private:
  static constexpr std::size_t kPad = 16;

  WindLaw law_;
  WindKernels kernels_ = wind_kernels();
  std::vector<TriangleRun> runs_;
  std::vector<int> loose_;  // ids of the triangles that fit no run
  Incidence at_;            // of those
  Array loose_thirds_;
  std::size_t stride_, loose_stride_;
};

}  // namespace sim
