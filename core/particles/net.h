// Springs that fit no run: a list of ends for every particle, eight particles side by side.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace sim {

// Both ends of every spring are listed. A slot of a block holds one end for each of its 8 particles
// whose bit is set in `present`. The ends of a particle are sorted, alike springs together, so that
// most slots need one stiffness and rest length only, and the order in which a scene lists its
// springs does not show in the bits.
class Net {
 public:
  struct Spring {
    int a, b;
    double k, rest;  // N/m, m
  };

  struct alignas(64) Slot {
    std::int32_t to[8] = {};             // some particle where there is no end
    double k = 0, rest = 0, k_rest = 0;  // of all its ends
    std::int32_t own = -1;               // or else where in ks and rests those of its ends begin
    std::uint8_t present = 0;
  };

  Net() = default;
  Net(int n, std::span<const Spring> springs);

  bool empty() const { return slots.empty(); }

  // Calls visit(to, k, rest) for every end at particle i.
  template <class Visit>
  void at(int i, Visit visit) const {
    if (empty()) return;
    const auto lane = static_cast<std::size_t>(i % 8);
    for (int s = first[static_cast<std::size_t>(i / 8)];
         s < first[static_cast<std::size_t>(i / 8) + 1]; ++s) {
      const Slot& slot = slots[static_cast<std::size_t>(s)];
      if (!(slot.present >> lane & 1)) break;
      const std::size_t own = static_cast<std::size_t>(slot.own) + lane;
      visit(slot.to[lane], slot.own < 0 ? slot.k : ks[own], slot.own < 0 ? slot.rest : rests[own]);
    }
  }

  std::vector<int> first;  // the first slot of each block, and one more
  std::vector<Slot> slots;
  std::vector<double> ks, rests;  // 8 for each slot whose springs differ
};

}  // namespace sim
