// Formulas of a distance that multiply by its inverse.
#pragma once

#include <span>

#include "core/expression/formulas.h"

namespace sim::expression {

// The program of `outputs` with 1/r, behind the other inputs, in place of quotients by r, the first
// of them, and by products of r: whoever has measured r has its inverse, too, and a quotient takes
// as long as several products.
Program with_inverse_distance(const Formulas& formulas, std::span<const int> outputs);

}  // namespace sim::expression
