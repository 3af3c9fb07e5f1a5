// Pseudo-random numbers, the same every time.
#pragma once

#include <cstdint>

namespace sim {

// Knuth's MMIX generator: The Art of Computer Programming 2 (1997), section 3.3.4.
class Noise {
 public:
  // In (-1/2, 1/2).
  double next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state_ >> 11) * 0x1p-53 - 0.5;
  }

 private:
  std::uint64_t state_ = 1;
};

}  // namespace sim
