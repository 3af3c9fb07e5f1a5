#include "core/particles/stiffness.h"

#include <cmath>

#include "core/base/inverse_sqrt.h"
#include "core/particles/springs.h"

namespace sim {

SpringStiffness spring_stiffness(const Vec3& d, double k, double rest) {
  const double square = square_of(d[0], d[1], d[2]);
  // Where the square overflows r/|d| is nothing.
  if (rest == 0 || !(square > kSafeLeast && square < kSafeMost)) return {k, 0};
  const double pull = k * rest / std::sqrt(square);
  return {k - pull, pull / square};
}

}  // namespace sim
