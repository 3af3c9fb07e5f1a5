// Sine and cosine from sums and products alone, so that they have the same bits on every machine.
#pragma once

#include <cmath>

namespace sim {

struct SineCosine {
  double sine, cosine;
};

// Sine and cosine of 2 pi `turns`, for any finite number of turns; error about 2e-16.
inline SineCosine sine_cosine(double turns) {
  // Whole turns and then quarters are taken off exactly; the rest is at most an eighth.
  turns -= std::floor(turns);
  const double quarters = std::floor(4 * turns + 0.5);
  const double x = 6.28318530717958647692 * (turns - 0.25 * quarters), z = x * x;
  // Taylor series by Horner's rule: 1 - z/(n-1)n (1 - z/(n+1)(n+2) (1 - ...)).
  double sine = 1, cosine = 1;
  for (int n = 17; n >= 1; n -= 2) {
    cosine = 1 - cosine * (z / (n * (n + 1)));
    sine = 1 - sine * (z / ((n + 1) * (n + 2)));
  }
  sine *= x;
  switch (static_cast<int>(quarters)) {
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    case 3:
      return {-cosine, sine};
    default:
      return {sine, cosine};
  }
}

}  // namespace sim
