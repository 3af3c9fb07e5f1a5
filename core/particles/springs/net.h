// Springs that fit no run: a list of ends for every particle, eight particles side by side.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/springs/spring_sense.h"
#include "core/particles/view.h"

namespace sim {

// Both ends of every spring are listed. A slot of a block holds one end for each of its 8 particles
// whose bit is set in `present`. The ends of a particle are sorted, alike springs together, so that
// most slots need one stiffness and rest length only, and the order in which a scene lists its
// springs does not show in the bits.
//
// Particles are in the blocks by id, unless they are many and their ids separate the ends of
// springs: then in an order in which the far ends of a block are mostly in the blocks shortly
// before, which are still in the cache.
class Net {
 public:
  struct Spring {
    int a, b;
    double k, rest;  // N/m, m
  };

  struct Kind {
    double k, rest, k_rest;
  };

  struct Slot {
    std::int32_t to[8];  // some particle where there is no end
    std::int32_t kind;   // of all its ends, or -1 - where in ks and rests theirs begin
    std::uint8_t present;
    std::size_t own() const { return static_cast<std::size_t>(-1 - kind); }
  };

  Net() = default;
  // Springs of another sense than both, or that change, have their own numbers in every slot.
  Net(int n, std::span<const Spring> springs, SpringSense sense = SpringSense::kBoth,
      bool own_numbers = false);

  bool empty() const { return slots.size() == 0; }
  bool reordered() const { return !order.empty(); }
  // The particles of a tile that may have ends.
  Tile used(Tile tile) const {
    if (reordered()) return tile;
    const int begin = std::max(tile.begin, used_.begin);
    return {begin, std::max(begin, std::min(tile.end, used_.end))};
  }
  int blocks() const { return static_cast<int>(first.size()) - 1; }

  const Kind& kind_of(const Slot& slot) const { return kinds[static_cast<std::size_t>(slot.kind)]; }

  // Calls visit(to, k, rest) for every end at particle i.
  template <class Visit>
  void at(int i, Visit visit) const {
    if (empty()) return;
    const int p = reordered() ? place[static_cast<std::size_t>(i)] : i;
    const auto block = static_cast<std::size_t>(p / 8), lane = static_cast<std::size_t>(p % 8);
    for (int s = first[block]; s < first[block + 1]; ++s) {
      const Slot& slot = slots[static_cast<std::size_t>(s)];
      if (!(slot.present >> lane & 1)) break;
      const double k = slot.kind < 0 ? ks[slot.own() + lane] : kind_of(slot).k;
      const double rest = slot.kind < 0 ? rests[slot.own() + lane] : kind_of(slot).rest;
      visit(slot.to[lane], k, rest);
    }
  }

  // Calls take(k, rest) for the own numbers of every end at i that leads to `other`, until it
  // returns true.
  template <class Take>
  void find(int i, int other, Take take) {
    if (empty()) return;
    const int p = reordered() ? place[static_cast<std::size_t>(i)] : i;
    const auto block = static_cast<std::size_t>(p / 8), lane = static_cast<std::size_t>(p % 8);
    for (int s = first[block]; s < first[block + 1]; ++s) {
      const Slot& slot = slots[static_cast<std::size_t>(s)];
      if (!(slot.present >> lane & 1)) break;
      if (slot.kind >= 0 || slot.to[lane] != other) continue;
      if (take(&ks[slot.own() + lane], &rests[slot.own() + lane])) return;
    }
  }

  // The particle at each place and the place of each particle, padded to whole blocks, if
  // reordered.
  std::vector<std::int32_t> order, place;
  std::vector<int> first;  // the first slot of each block, and one more
  ArrayOf<Slot> slots;
  std::vector<Kind> kinds;
  std::vector<double> ks, rests;  // 8 for each slot whose springs differ
  SpringSense sense = SpringSense::kBoth;

 private:
  Tile used_;  // whole blocks
};

}  // namespace sim
