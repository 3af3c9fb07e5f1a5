// Springs, ties and rods that break between steps when they are overloaded.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/particles/view.h"

namespace sim {

using TornPairs = std::span<const std::array<int, 2>>;  // ids, the lower first, ascending

// The breakable ties of a force or a constraint, numbered in the order of the scene. The set of
// broken ones is a setting of a run, like the set of active forces: a force is a pure function of
// (t, X) and of these. A constraint leaves the equations of broken ties out of its pattern.
class Breakable {
 public:
  virtual ~Breakable() = default;

  virtual int ties() const = 0;
  virtual std::array<int, 2> ends(int tie) const = 0;
  virtual double energy(const ParticleView& view, int tie) const = 0;  // J, of one that is whole

  // Appends the unbroken ties that this state loads beyond their limit, ascending. multipliers: of
  // the equations of a constraint, N; a force has none.
  virtual void find_overloaded(const ParticleView& view, std::span<const double> multipliers,
                               std::vector<int>& ties) const = 0;
  // Appends the ties, broken or whole, that bridge a torn pair, such as a spring to the second next
  // particle where that to the next broke. They break, too.
  virtual void find_bridges(TornPairs /*torn*/, std::vector<int>& /*ties*/) const {}
  // Replaces the set of broken ties, ascending.
  virtual void set_broken(std::span<const int> ties) = 0;
};

}  // namespace sim
