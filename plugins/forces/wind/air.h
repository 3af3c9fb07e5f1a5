// Moving air: a mean velocity, and turbulence that is smooth in space and time.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/math/vec3.h"
#include "core/particles/force.h"

namespace sim {

// e b(k.x + s), with b a random function of period `period`: divergence-free since e and k are at
// right angles. Knot j of b has 8 numbers at table[8 j]: c0 c1 c2 0 c3 c4 c5 0, the coefficients of
// b(j + u) = sum c_i u^i.
struct AirWave {
  Vec3 k{0, 0, 0}, e{0, 0, 0};            // 1/m, m/s
  double s = 0, period = 1, inverse = 1;  // 1 / period
  const double* table = nullptr;
};

// The air at one moment.
struct AirNow {
  static constexpr int kMost = 3;
  Vec3 mean{0, 0, 0};  // m/s
  int waves = 0;
  std::array<AirWave, kMost> wave;

  // The velocity at x, m/s, and its derivative by x.
  Vec3 velocity(const Vec3& x, Mat3* slope = nullptr) const;
};

// Three waves run along directions at right angles, each with its velocity along the next of them:
// the turbulence has no divergence, mean 0 and on each axis the mean square strength^2. At one
// point it changes in the time tau, at one time over the length; its spectrum is that of
// random_spline.h. Each wave repeats itself after some thousand tau, but no two of them after the
// same time.
class Air {
 public:
  struct Breeze {
    double strength = 0;    // m/s, root mean square on each axis; 0: none
    double tau = 1;         // s
    double length = 0;      // m; 0: the same everywhere
    std::int64_t seed = 1;  // the same seed, the same bits
  };

  Air(const Vec3& mean, const Breeze& breeze);

  AirNow at(double t) const;

 private:
  AirNow still_;  // but for the phases
  double tau_;
  bool uniform_;
  std::vector<std::vector<double>> tables_;
};

}  // namespace sim
