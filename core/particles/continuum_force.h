// Forces of cells that fill a body, and the quality of the cells.
#pragma once

#include <cmath>

#include "core/particles/force.h"

namespace sim {

// The quality of the deformed cells of a body, by their deformation gradients F = dx/dX.
struct CellQuality {
  int cells = 0;
  int inverted = 0;   // det F < 0 somewhere in them
  int smallest = -1;  // the most compressed cell, counted from 0
  double volume = 1;  // det F there
  double least = 1;   // smallest and largest principal stretch of all
  double most = 1;
  double angle = 0;        // rad, by which a right angle changes at most
  double strain_jump = 0;  // largest |E - mean of E around a corner|, E = (F^T F - 1) / 2
  int jumps = -1;          // the cell of that

  void take(const CellQuality& other);  // the worse of each
};

// The largest change of a right angle under principal stretches a >= b.
inline double shear_angle(double a, double b) {
  return std::asin((a * a - b * b) / (a * a + b * b));
}

class ContinuumForce : public Force {
 public:
  // Evaluates the cells at a state; may take memory.
  virtual CellQuality cell_quality(const ParticleView& view) const = 0;
};

inline void CellQuality::take(const CellQuality& other) {
  cells += other.cells;
  inverted += other.inverted;
  if (other.volume < volume || smallest < 0) {
    smallest = other.smallest;
    volume = other.volume;
  }
  least = std::fmin(least, other.least);
  most = std::fmax(most, other.most);
  angle = std::fmax(angle, other.angle);
  if (other.strain_jump > strain_jump) {
    strain_jump = other.strain_jump;
    jumps = other.jumps;
  }
}

}  // namespace sim
