// The force of wind on one triangle, and on many at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "air.h"
#include "core/particles/force.h"

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

// Particles of a block, whatever the vectors, and the number whose triangles are evaluated before
// their sums.
inline constexpr int kWindBlock = 8;
inline constexpr int kWindChunk = 64;

// A run of triangles a, a + b, a + c, and the rings that hold a third of the force on them for the
// other corners: mask + 1 entries, a power of two, whose first eight are repeated at the end.
struct TriangleRing {
  std::int64_t b, c, mask;
  const std::uint8_t* bits;  // of the first corners, eight to an entry
  double* third[3];          // N; x, y, z
};

struct WindKernels {
  // sink += the force on the particles of a tile that begins with a multiple of 8, whose block goes
  // to `turn` in the rings. Without arrays in `sink` the rings are filled alone.
  void (*sweep)(const WindLaw& law, const AirNow& air, const ParticleView& view,
                std::span<const TriangleRing> rings, std::int64_t turn, Tile tile, ForceSink sink);
  // third := a third of the force on the triangles [begin, end), three ids each; begin is a
  // multiple of 8. `stride`: from x to y.
  void (*any)(const WindLaw& law, const AirNow& air, const ParticleView& view, const int* ids,
              int begin, int end, double* third, std::size_t stride);
};
WindKernels wind_kernels();  // for this machine

}  // namespace sim
