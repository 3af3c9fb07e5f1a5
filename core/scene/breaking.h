// The breakable ties of a scene, numbered over all of its forces and then over all of its
// constraints, and the set of broken ones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/particles/breakable.h"
#include "core/particles/constraints/constraints.h"
#include "core/particles/force.h"

namespace sim {

// Ties break between steps: all that are loaded beyond their limit at the end of a step, and with
// them those that would bridge the gap, in the order of the scene, independently of threads and
// methods.
class Breaking {
 public:
  // Adds every force of the scene in its order, with the name of its switch; empty: none.
  void add(Force& force, const std::string& switch_name);
  // Called once all parts are bound; constraints: null if the scene has none.
  void begin(const Constraints* constraints);

  bool any() const { return count_ > 0; }
  int count() const { return count_; }
  int of_forces() const { return first_rod_; }  // the first ones
  int of_constraints() const { return count_ - first_rod_; }

  // The unbroken ties that this state loads beyond their limit, ascending; those of inactive forces
  // do not break. multipliers: of all constraints, N.
  std::vector<int> overloaded(const ParticleView& view, std::span<const double> multipliers,
                              std::span<const std::string> off) const;
  // The broken ties and these, and all that bridge what is torn then, ascending.
  std::vector<int> with_bridges(std::vector<int> broken) const;
  std::vector<int> whole_between(int a, int b) const;
  double energy(const ParticleView& view, std::span<const int> ties) const;  // J

  // Replaces the set of broken ties, ascending. True if the equations of constraints changed.
  bool set_broken(std::span<const int> ties);
  // Pairs whose ties broke and that nothing else joins, the lower id first, ascending.
  std::span<const std::array<int, 2>> torn() const { return torn_; }

 private:
  struct Part {
    Breakable* ties;
    int first;
    std::string switch_name;
    int constraint = -1;  // which one; -1: a force
  };
  const Part& part_of(int tie) const;
  void add_ties(Part part);
  void count_others(std::span<const std::array<int, 2>> whole_rods);
  std::vector<std::array<int, 2>> torn_by(std::span<const int> broken) const;

  std::vector<Force*> forces_;
  std::vector<Part> parts_;
  const Constraints* constraints_ = nullptr;
  int count_ = 0, first_rod_ = 0;
  std::vector<std::uint8_t> broken_;       // of each tie
  std::vector<std::array<int, 2>> pairs_;  // that ties join, ascending
  std::vector<int> pair_of_;               // of each tie
  std::vector<int> others_;                // of each pair: the unbreakable elements between them
  std::vector<std::array<int, 2>> torn_;
};

}  // namespace sim
