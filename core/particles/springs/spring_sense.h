// The directions in which springs pull: both, or one alone.
#pragma once

namespace sim {

// A cable carries tension alone and a strut compression alone: k becomes 0 where it is slack. The
// value is the sign of |d| - rest for which the spring acts.
enum class SpringSense { kBoth = 0, kTension = 1, kCompression = -1 };

// True if |d| - rest has the other sign; sizes are |d| and rest, or the squares of both. At rest
// length neither is slack, so that the stiffness there is that of the spring.
inline bool slack(SpringSense sense, double size, double rest_size) {
  return static_cast<double>(static_cast<int>(sense)) * (size - rest_size) < 0;
}

}  // namespace sim
