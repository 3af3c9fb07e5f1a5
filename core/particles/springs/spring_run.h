// Runs of springs: those of constant index stride, as arrays.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/array.h"
#include "core/base/bits.h"
#include "core/particles/springs/spring_sense.h"

namespace sim {

// Springs between a and a + stride for every particle a whose bit is set in `owners`.
struct SpringRun {
  static constexpr int kPad = 16;  // a vector of entries may begin before particle 0

  int stride = 0;
  int count = 0;
  bool uniform = true;
  SpringSense sense = SpringSense::kBoth;  // of one sense alone: never uniform
  double k = 0, rest = 0;                  // N/m and m, of all springs of a uniform run
  Array ks, rests;                         // otherwise: entry a + kPad for the spring that a owns
  std::vector<std::uint8_t> owners;        // bit a % 8 of byte a / 8; n / 8 + 2 bytes

  bool owns(int a) const { return bit(owners.data(), a); }
  double k_of(int a) const { return uniform ? k : ks[static_cast<std::size_t>(a + kPad)]; }
  double rest_of(int a) const { return uniform ? rest : rests[static_cast<std::size_t>(a + kPad)]; }
};

// A run as kernels read it: arrays indexed by the particle that owns the spring.
struct RunColumns {
  const std::uint8_t* owners;
  const double *ks, *rests;         // null in a uniform run
  double k, rest, k_rest, minus_k;  // of a uniform run
  std::int64_t stride;
  SpringSense sense;

  explicit RunColumns(const SpringRun& run)
      : owners(run.owners.data()),
        ks(run.uniform ? nullptr : run.ks.data() + SpringRun::kPad),
        rests(run.uniform ? nullptr : run.rests.data() + SpringRun::kPad),
        k(run.k),
        rest(run.rest),
        k_rest(run.k * run.rest),
        minus_k(-run.k),
        stride(run.stride),
        sense(run.sense) {}

  double k_of(std::int64_t a) const { return ks ? ks[a] : k; }
  double rest_of(std::int64_t a) const { return ks ? rests[a] : rest; }
};

}  // namespace sim
