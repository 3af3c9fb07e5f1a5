// A force evaluated from one tile of particles to the next, while these are in cache.
#pragma once

#include "core/particles/view.h"

namespace sim {

// For a force that joins particles near by number. One of these goes over a range of particles,
// once an evaluation; others do the rest of them on other threads, or other evaluations meanwhile.
// It keeps results for particles that come later.
class ForceSweep {
 public:
  virtual ~ForceSweep() = default;

  // No two particles that it joins are further apart by number.
  virtual int reach() const = 0;

  // From particle `begin` on, a multiple of 8. Reads the particles within reach of it.
  virtual void start(const ParticleView& view, int begin) = 0;

  // Adds the same forces as Force::accumulate(), bit for bit, for the tile after the last one; all
  // but the last are multiples of 8. Reads the particles from it on, up to reach behind its end.
  virtual void add(const ParticleView& view, Tile tile, ForceSink sink) = 0;
};

}  // namespace sim
