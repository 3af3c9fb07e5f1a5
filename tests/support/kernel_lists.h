// Lists of neighbours as kernels read them, of every particle and all others.
#pragma once

#include <vector>

#include "core/particles/neighbours/neighbours.h"
#include "tests/support/kernel_cases.h"

namespace sim_test {

// `items` particles in the lowest places, one after the other; the last block is filled up with
// places of no particle, far away. Each list has all others, and its own place behind them.
struct AllPairs {
  int items, places;
  Column points;  // four numbers a place
  std::vector<std::int32_t> slots;
  std::vector<sim::NeighbourBlock> blocks;

  explicit AllPairs(int count)
      : items(count), places((count + 7) / 8 * 8), points(4 * places), length(items + 1) {
    slots.resize(static_cast<std::size_t>(places * length));
    for (int b = 0; b < places / 8; ++b) {
      std::int32_t* const own = slots.data() + 8 * b * length;
      sim::NeighbourBlock block{own, length, {}};
      for (int lane = 0; lane < 8; ++lane) {
        const int i = 8 * b + lane;
        for (int k = 0; k < length; ++k) own[8 * k + lane] = i;
        if (i >= items) continue;
        for (int j = 0; j < items; ++j)
          if (j != i) own[8 * block.count[lane]++ + lane] = j;
      }
      blocks.push_back(block);
    }
    for (int i = 0; i < places; ++i)
      for (int k = 0; k < 3; ++k) points[4 * i + k] = i < items ? 0 : 1e5 * (i + 1);
  }
  AllPairs(const AllPairs&) = delete;
  AllPairs& operator=(const AllPairs&) = delete;

  void set(int i, const sim::Vec3& x) {
    for (int k = 0; k < 3; ++k) points[4 * i + k] = x[static_cast<std::size_t>(k)];
  }
  sim::Vec3 at(int i) const { return {points[4 * i], points[4 * i + 1], points[4 * i + 2]}; }

 private:
  std::int32_t length;
};

// Particle `i` of a loose pile, some 0.8 from the next.
inline sim::Vec3 piled(int i) {
  return {0.8 * (i % 4) + 0.1 * scattered(i, 1), 0.8 * (i / 4 % 4) + 0.1 * scattered(i, 2),
          0.8 * (i / 16) + 0.1 * scattered(i, 3)};
}

}  // namespace sim_test
