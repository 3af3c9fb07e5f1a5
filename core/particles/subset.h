// Some of the particles of a system, as ranges of their ids.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/base/layout.h"
#include "core/particles/view.h"

namespace sim {

class Subset {
 public:
  Subset() = default;
  explicit Subset(std::span<const int> ids);  // ascending

  int count() const { return count_; }
  int id(int i) const;  // of the i-th of them

  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const auto& [begin, end] : ranges_)
      for (int i = begin; i < end; ++i) visit(i);
  }

  // Copies positions and velocities of the subset from a state of all, or back.
  void gather(const Layout& all, const double* from, double* to) const;
  void scatter(const double* from, const Layout& all, double* to) const;

  // Kinetic energy, J; infinite if a pinned particle moves.
  double kinetic_energy(const ParticleView& all) const;

 private:
  std::vector<std::array<int, 2>> ranges_;  // [begin, end)
  int count_ = 0;
};

}  // namespace sim
