// Formulas of a distance that divide as little as possible.
#pragma once

#include "core/expression/formulas.h"

namespace sim::expression {

// The energy U(r) of a pair and the factor of its force, f = -factor d. Whoever has measured the
// first input has its inverse, too, which comes behind the other inputs: products of it take the
// place of quotients, for a quotient takes as long as several products.
struct PairPrograms {
  // An energy of even powers of r alone is a formula of q = r^2, and the factor 2 dU/dq: nobody
  // takes a root then. Else the factor is U'(r), and -factor d/r the force.
  bool of_square = false;
  Program energy, factor;

  PairPrograms() = default;
  PairPrograms(const Formulas& formulas, int energy);  // whose first input is r
};

}  // namespace sim::expression
