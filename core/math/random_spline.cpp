#include "core/math/random_spline.h"

#include <cmath>

#include "core/base/hash.h"

namespace sim {

double RandomSpline::at(double s) const {
  const double knot = std::floor(s), u = s - knot;
  const double u2 = u * u, u3 = u2 * u, u4 = u2 * u2, u5 = u4 * u;
  const double r = 1 - u;
  const double weights[] = {r * r * r * r * r,
                            26 - 50 * u + 20 * u2 + 20 * u3 - 20 * u4 + 5 * u5,
                            66 - 60 * u2 + 30 * u4 - 10 * u5,
                            26 + 50 * u + 20 * u2 - 20 * u3 - 20 * u4 + 10 * u5,
                            1 + 5 * u + 10 * u2 + 10 * u3 + 5 * u4 - 5 * u5,
                            u5};
  double sum = 0;
  for (int j = 0; j < 6; ++j) sum += weights[j] * coefficient(static_cast<std::int64_t>(knot) + j);
  return sum / 120;
}

double RandomSpline::coefficient(std::int64_t k) const {
  constexpr double kB11 = 655177.0 / 1663200.0;
  StateHash hash;
  for (const std::uint64_t word : {seed_, stream_, static_cast<std::uint64_t>(k)}) hash.add(word);
  const double uniform = static_cast<double>(hash.value() >> 11) * 0x1p-52 - 1;
  return uniform * std::sqrt(3 / kB11);
}

RandomSpline::Polynomial RandomSpline::polynomial(const std::array<double, 6>& c) {
  constexpr double kBasis[6][6] = {{1, -5, 10, -10, 5, -1},  {26, -50, 20, 20, -20, 5},
                                   {66, 0, -60, 0, 30, -10}, {26, 50, 20, -20, -20, 10},
                                   {1, 5, 10, 10, 5, -5},    {0, 0, 0, 0, 0, 1}};
  Polynomial sum{};
  for (std::size_t j = 0; j < 6; ++j)
    for (std::size_t power = 0; power < 6; ++power) sum[power] += c[j] * kBasis[j][power] / 120;
  return sum;
}

}  // namespace sim
