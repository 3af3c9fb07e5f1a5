// The breakable ties of a scene, numbered over all of its forces, and the set of broken ones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/particles/breakable.h"
#include "core/particles/force.h"

namespace sim {

// Ties break between steps: all that are loaded beyond their limit at the end of a step, in the
// order of the scene, independently of threads and methods.
class Breaking {
 public:
  // Adds every force of the scene in its order, with the name of its switch; empty: none.
  void add(Force& force, const std::string& switch_name);
  // Called once all forces are bound.
  void begin();

  bool any() const { return count_ > 0; }
  int count() const { return count_; }

  // The unbroken ties of active forces that this state loads beyond their limit, ascending.
  std::vector<int> overloaded(const ParticleView& view, std::span<const std::string> off) const;
  std::vector<int> whole_between(int a, int b) const;
  double energy(const ParticleView& view, std::span<const int> ties) const;  // J

  // Replaces the set of broken ties, ascending.
  void set_broken(std::span<const int> ties);
  // Pairs whose ties broke and that nothing else joins, the lower id first, ascending.
  std::span<const std::array<int, 2>> torn() const { return torn_; }

 private:
  struct Part {
    Breakable* ties;
    int first;
    std::string switch_name;
  };
  const Part& part_of(int tie) const;

  std::vector<Force*> forces_;
  std::vector<Part> parts_;
  int count_ = 0;
  std::vector<std::uint8_t> broken_;       // of each tie
  std::vector<std::array<int, 2>> pairs_;  // that ties join, ascending
  std::vector<int> pair_of_;               // of each tie
  std::vector<int> others_;                // of each pair: the unbreakable elements between them
  std::vector<std::array<int, 2>> torn_;
};

}  // namespace sim
