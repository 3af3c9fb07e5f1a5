// A force evaluated from one tile of particles to the next, while these are in cache.
#pragma once

#include "core/particles/view.h"

namespace sim {

// A sweep of a force that joins particles near in id. Each one goes over a range of particles, once
// an evaluation; others may take the rest on other threads, or other evaluations meanwhile. It
// stores results for particles that come later.
class ForceSweep {
 public:
  virtual ~ForceSweep() = default;

  // The largest distance in id of two particles that it joins.
  virtual int reach() const = 0;

  // Begins at particle `begin`, a multiple of 8. Reads the particles within reach of it.
  virtual void start(const ParticleView& view, int begin) = 0;

  // Adds the same forces as Force::accumulate(), bit for bit, for the tile after the last one; all
  // but the last are multiples of 8. Reads particles from the tile's begin up to `reach` beyond its
  // end.
  virtual void add(const ParticleView& view, Tile tile, ForceSink sink) = 0;
};

}  // namespace sim
