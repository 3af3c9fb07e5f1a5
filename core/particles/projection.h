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
  // Changes these numbers. False: no place and no velocity had to be changed. A pure function of
  // them, bit for bit.
  virtual bool project(const End& end, Team& team) = 0;
  virtual bool leads(int particle) const = 0;  // it may change this one

  // What a verdict says of all steps since the last forget(), and whether that keeps what was
  // promised.
  struct Account {
    std::string words;
    bool kept = true;
  };
  virtual Account account() const = 0;
  virtual void forget() = 0;
};

inline bool any_projects(std::span<Force* const> forces) {
  return std::ranges::any_of(forces, [](Force* force) { return force->projection() != nullptr; });
}

}  // namespace sim
