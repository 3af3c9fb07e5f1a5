// Wall-clock time since a moment.
#pragma once

#include <chrono>

namespace sim {

class Stopwatch {
 public:
  double seconds() const {  // since it was made
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace sim
