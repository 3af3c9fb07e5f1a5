// Ties that break between steps when they are overloaded.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/particles/view.h"

namespace sim {

// The breakable ties of a force, numbered in the order of the scene. The set of broken ones is a
// setting of a run, like the set of active forces: the force is a pure function of (t, X) and of
// these.
class Breakable {
 public:
  virtual ~Breakable() = default;

  virtual int ties() const = 0;
  virtual std::array<int, 2> ends(int tie) const = 0;
  virtual double energy(const ParticleView& view, int tie) const = 0;  // J, of one that is whole

  // Appends the unbroken ties that this state loads beyond their limit, ascending.
  virtual void find_overloaded(const ParticleView& view, std::vector<int>& ties) const = 0;
  // Replaces the set of broken ties, ascending.
  virtual void set_broken(std::span<const int> ties) = 0;
};

}  // namespace sim
