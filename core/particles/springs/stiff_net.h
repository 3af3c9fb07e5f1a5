// K = -dF/dx of the springs of a net at one point.
#pragma once

#include <cstddef>
#include <vector>

#include "core/particles/springs/net.h"
#include "core/particles/springs/spring_stiffness.h"

namespace sim {

// The ends are stored by particle id, whatever the net's own order, as in products: the j-th end of
// each of 8 particles side by side.
class StiffNet {
 public:
  StiffNet(const Net& net, int n) : net_(&net) {
    for (int i = 0; i < n; ++i) {
      if (i % 8 == 0) first_.push_back(slots_.size());
      std::size_t slot = first_.back();
      net.at(i, [&](int to, double, double) {
        if (slot == slots_.size()) slots_.emplace_back();
        slots_[slot++].to[i % 8] = to;
      });
      count_.push_back(static_cast<int>(slot - first_.back()));
    }
  }

  SpringSense sense() const { return net_->sense; }

  // Takes stiffness(to, k, rest) for every end at particle i.
  template <class StiffnessOf>
  void linearise(int i, StiffnessOf stiffness) {
    Slot* slot = slots_.data() + first_[static_cast<std::size_t>(i / 8)];
    net_->at(i, [&](int to, double k, double rest) {
      (slot++)->stiffness[i % 8] = stiffness(to, k, rest);
    });
  }

  // stiffness := change(to, k, stiffness) for every end at particle i.
  template <class Change>
  void change(int i, Change change) {
    Slot* slot = slots_.data() + first_[static_cast<std::size_t>(i / 8)];
    net_->at(i, [&](int to, double k, double) {
      SpringStiffness& stiffness = (slot++)->stiffness[i % 8];
      stiffness = change(to, k, stiffness);
    });
  }

  // Calls visit(to, stiffness) for every end at particle i.
  template <class Visit>
  void at(int i, Visit visit) const {
    const Slot* slot = slots_.data() + first_[static_cast<std::size_t>(i / 8)];
    for (int left = count_[static_cast<std::size_t>(i)]; left > 0; --left, ++slot)
      visit(slot->to[i % 8], slot->stiffness[i % 8]);
  }

 private:
  struct Slot {
    int to[8];
    SpringStiffness stiffness[8];
  };

  const Net* net_;
  std::vector<int> count_;          // of the ends of each particle
  std::vector<std::size_t> first_;  // slot of each 8 particles
  std::vector<Slot> slots_;
};

}  // namespace sim
