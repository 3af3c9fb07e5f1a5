#include "air.h"

#include <cmath>

#include "core/math/random_spline.h"

namespace sim {
namespace {

// Primes, so that all waves together repeat only after their product.
constexpr int kPeriods[AirNow::kMost] = {1009, 1013, 1019};

// One period of a random spline, made periodic, with mean 0 and mean square 1 to rounding.
std::vector<double> periodic_table(std::int64_t seed, int wave) {
  const RandomSpline spline(static_cast<std::uint64_t>(seed), static_cast<std::uint64_t>(wave));
  const auto period = static_cast<std::size_t>(kPeriods[wave]);
  std::vector<double> c(period);
  double sum = 0;
  for (std::size_t k = 0; k < period; ++k)
    sum += c[k] = spline.coefficient(static_cast<std::int64_t>(k));
  for (double& each : c) each -= sum / static_cast<double>(period);

  std::vector<double> table(8 * period);
  double square = 0;
  for (std::size_t knot = 0; knot < period; ++knot) {
    std::array<double, 6> near;
    for (std::size_t j = 0; j < 6; ++j) near[j] = c[(knot + j) % period];
    const RandomSpline::Polynomial p = RandomSpline::polynomial(near);
    for (std::size_t i = 0; i < 6; ++i) {
      table[8 * knot + i + (i > 2)] = p[i];
      for (std::size_t j = 0; j < 6; ++j) square += p[i] * p[j] / static_cast<double>(i + j + 1);
    }
  }
  const double scale = 1 / std::sqrt(square / static_cast<double>(period));
  for (double& number : table) number *= scale;
  return table;
}

// Reduces any number to [0, period).
double reduced(double s, double period) {
  if (!(std::fabs(s) < 0x1p50)) return 0;
  const double rest = s - period * std::floor(s / period);
  return rest < period ? rest : 0;
}

struct SplineValue {
  double b, slope;
};

SplineValue value_of(const AirWave& wave, double s) {
  const double place = reduced(s, wave.period), knot = std::floor(place), u = place - knot;
  const double* const c = wave.table + 8 * static_cast<std::ptrdiff_t>(knot);
  return {c[0] + u * (c[1] + u * (c[2] + u * (c[4] + u * (c[5] + u * c[6])))),
          c[1] + u * (2 * c[2] + u * (3 * c[4] + u * (4 * c[5] + u * 5 * c[6])))};
}

}  // namespace

Vec3 AirNow::velocity(const Vec3& x, Mat3* slope) const {
  Vec3 sum = mean;
  for (int i = 0; i < waves; ++i) {
    const AirWave& w = wave[static_cast<std::size_t>(i)];
    const SplineValue value = value_of(w, w.k.dot(x) + w.s);
    sum += value.b * w.e;
    if (slope) *slope += value.slope * outer(w.e, w.k);
  }
  return sum;
}

Air::Air(const Vec3& mean, const Breeze& breeze) : tau_(breeze.tau), uniform_(breeze.length == 0) {
  still_.mean = mean;
  if (breeze.strength == 0) return;
  const Vec3 axes[AirNow::kMost] = {
      {2.0 / 3, -1.0 / 3, 2.0 / 3}, {2.0 / 3, 2.0 / 3, -1.0 / 3}, {-1.0 / 3, 2.0 / 3, 2.0 / 3}};
  still_.waves = AirNow::kMost;
  for (int i = 0; i < AirNow::kMost; ++i) {
    AirWave& wave = still_.wave[static_cast<std::size_t>(i)];
    tables_.push_back(periodic_table(breeze.seed, i));
    wave.table = tables_.back().data();
    wave.period = kPeriods[i];
    wave.inverse = 1 / wave.period;
    if (!uniform_) wave.k = 1 / breeze.length * axes[i];
    wave.e = breeze.strength * axes[(i + 1) % AirNow::kMost];
  }
}

AirNow Air::at(double t) const {
  AirNow now = still_;
  for (int i = 0; i < now.waves; ++i) {
    AirWave& wave = now.wave[static_cast<std::size_t>(i)];
    wave.s = reduced(-t / tau_, wave.period);
  }
  if (!uniform_) return now;
  now.mean = now.velocity(Vec3(0, 0, 0));
  now.waves = 0;
  return now;
}

}  // namespace sim
