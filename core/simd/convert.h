// Arrays of doubles as floats and back.
#pragma once

namespace sim {

struct Convert {
  void (*to_float)(const double* from, float* to, int count);  // rounded to nearest
  void (*to_double)(const float* from, double* to, int count);
};
Convert convert();  // for this machine

}  // namespace sim
