// A 64-bit hash of the bits of a state: two runs agree in every bit or, almost surely, in no hash.
#pragma once

#include <bit>
#include <cstdint>
#include <span>

namespace sim {

class StateHash {
 public:
  void add(std::uint64_t word) {
    // The mixing function of SplitMix64 (Steele, Lea & Flood 2014), chained.
    state_ += word + 0x9e3779b97f4a7c15;
    state_ = (state_ ^ (state_ >> 30)) * 0xbf58476d1ce4e5b9;
    state_ = (state_ ^ (state_ >> 27)) * 0x94d049bb133111eb;
    state_ ^= state_ >> 31;
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(std::span<const double> values) {
    for (const double value : values) add(value);
  }

  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0;
};

}  // namespace sim
