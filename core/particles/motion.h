// The motion that all forces and methods share: masses, gravity and drag.
#pragma once

#include <cstdint>

namespace sim {

// q' = v, v' = F(q) / m + g - (c / m) v, without F.
struct Motion {
  const std::uint8_t* free = nullptr;      // a bit a particle; 0 where pinned
  const double* inverse_masses = nullptr;  // 1/kg, null when all free particles have the same
  double inverse_mass = 0;                 // 1/kg
  double gravity[3] = {};                  // m/s^2
  double damping = 0;                      // kg/s
};

}  // namespace sim
