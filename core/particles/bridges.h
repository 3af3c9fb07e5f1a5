// Ties of a grid that pass over particles, and so bridge a tear between these.
#pragma once

#include <vector>

#include "core/particles/breakable.h"
#include "core/particles/elements/torn_faces.h"

namespace sim {

class Bridges {
 public:
  // Tie number `tie` from a to b goes in equal parts from particle to particle.
  void add(int tie, int a, int b, int parts) {
    if (parts > 1) ties_.push_back({tie, a, (b - a) / parts, parts});
  }
  bool empty() const { return ties_.empty(); }

  // Appends those of which a part is torn, in the order in which they were added.
  void find(TornPairs torn, std::vector<int>& found) const {
    if (torn.empty()) return;
    for (const Tie& tie : ties_)
      for (int part = 0; part < tie.parts; ++part)
        if (const int from = tie.first + part * tie.stride;
            torn_edge(torn, from, from + tie.stride)) {
          found.push_back(tie.tie);
          break;
        }
  }

 private:
  struct Tie {
    int tie, first, stride, parts;
  };
  std::vector<Tie> ties_;
};

}  // namespace sim
