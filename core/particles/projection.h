// What a force does between steps: it leads the state at the end of one back to what it allows.
#pragma once

#include <algorithm>
#include <span>
#include <string>

#include "core/base/team.h"
#include "core/particles/force.h"

namespace sim {

class Projection {
 public:
  virtual ~Projection() = default;

  // The end of a step of length h (s): q and v are the places and velocities of the view, memory is
  // that of the force.
  struct End {
    const ParticleView& view;
    double h;
    double* const* q;
    double* const* v;
    std::span<double> memory;
  };
  // Changes these numbers. False: none had to be changed. A pure function of them, bit for bit.
  virtual bool project(const End& end, Team& team) = 0;

  // What a verdict says of all steps so far, and whether that keeps what was promised.
  struct Account {
    std::string words;
    bool kept = true;
  };
  virtual Account account() const = 0;
};

inline bool any_projects(std::span<Force* const> forces) {
  return std::ranges::any_of(forces, [](Force* force) { return force->projection() != nullptr; });
}

}  // namespace sim
