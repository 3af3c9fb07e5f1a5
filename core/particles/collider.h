// Where particles may not go: a solid whose surface may move as a function of time.
#pragma once

#include <cstdint>

#include "core/particles/solid.h"
#include "core/particles/view.h"

namespace sim {

// The surface as seen from one point.
struct Touch {
  double gap = 0;          // m, signed distance: < 0 inside
  Vec3 normal{0, 1, 0};    // outward, of length 1, defined everywhere
  Vec3 velocity{0, 0, 0};  // of the surface there, m/s
};

struct Surface {
  double restitution = 0;  // 0 .. 1: the share of the normal velocity that a bounce gives back
};

// A collider is a pure function of (t, x), as forces are.
class Collider {
 public:
  virtual ~Collider() = default;

  // Called once with the initial state; may allocate and may throw Error.
  virtual void bind(const ParticleView& /*initial*/) {}

  virtual Surface surface() const = 0;

  // How it is drawn at time t; without, it is not.
  virtual Solid solid(double /*t*/) const { return {}; }

  // From the point x at time t. The gap changes by at most the way between two points, so that it
  // bounds the way that is free.
  virtual Touch touch(double t, const Vec3& x) const = 0;

  // m/s, a bound on the velocity of the surface between two times.
  virtual double fastest(double /*t0*/, double /*t1*/) const { return 0; }

  // near[i - tile.begin] := 1 for every particle whose gap may be less than the margin, in m. May
  // say so of others; asked of all particles in every step, so that a quick answer pays.
  virtual void near(double t, const ParticleView& view, Tile tile, double margin,
                    std::uint8_t* near) const {
    for (int i = tile.begin; i < tile.end; ++i)
      if (touch(t, view.position(i)).gap < margin) near[i - tile.begin] = 1;
  }
};

}  // namespace sim
