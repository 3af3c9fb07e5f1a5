// Numbers as colours: a quantity at each particle, and the scale that shows it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/picture/look.h"
#include "core/picture/model.h"
#include "core/picture/moments.h"
#include "core/picture/picture.h"

namespace sim {

struct ColourScale {
  std::string name, unit;  // "strain", "%"
  double factor = 1;       // from SI to the unit
  double most = 1;         // the end of the scale, SI; with both signs it begins at -most
  bool both_signs = false;

  V3 colour(double value) const;    // grey for a value that is not finite
  unsigned screen(double s) const;  // 0 .. 1 along the scale, as 0xRRGGBB
};

// One value a particle. strain: of the spring there that is strained most, with its sign; speed:
// m/s; energy: kinetic and half of that in each of its springs, J; error and mode: the values of
// the frame; a name of a lattice: that number of each cell. Empty where there is none.
std::vector<double> quantity(const Model& model, const Frame& frame, const std::string& name);

// The quantity that a look colours by: the one it names, or the first number of a lattice.
std::string colour_of(const Look& look, std::span<const Model> models);

// The colour scale of a whole run: up to the largest value, rounded up to 1, 2, 3 or 5 times a
// power of ten.
ColourScale colour_scale(const Look& look, std::span<const Model> models, const Moments& moments);

// The end of a scale for changing values: it grows at once, and shrinks when less than a fifth is
// used.
inline double steady_most(double now, double before) {
  return now > before || now < 0.2 * before ? now : before;
}

// The smallest of 1, 2, 3, 5 times a power of ten that is at least the value; 1 for values up to 0.
double round_up(double value);

}  // namespace sim
