// Constraints where surfaces touch: the displacements by contact are projected back onto them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/base/disjoint_sets.h"
#include "core/base/slot.h"
#include "core/particles/constraints/constraint_system.h"

namespace sim {

// Displacements and velocities of all particles in one step, whose ends have to satisfy the
// constraints.
//
// If no such displacements without contact are found, an island of constrained particles and its
// contacts moves only a fraction a of its step, then is projected back: each displacement becomes
// w + a (d - w), with d the free one and w the mean of the island by mass, or 0 if constraints fix
// it in space; the projection takes a move of order (1 - a) a. With a = 0 an island moves as one,
// and in the end not at all: then it satisfies constraints that do not move, as it did before.
class ConstrainedIslands {
 public:
  ConstrainedIslands(Particles& particles, ConstraintSystem& constraint_system);

  // Begins a step from x at t to x_next at t + h.
  void begin(double t, double h, const double* x, const double* x_next);

  // Projects from + displacement onto the constraints, and marks the changed displacements in both
  // lists. False if there is no solution in reach.
  bool project_displacements(std::span<const Vec3> from, std::span<Vec3> displacement,
                             std::span<std::uint8_t> touched, std::span<std::uint8_t> dirty);
  // Projects the velocities at these positions likewise.
  bool project_velocities(std::span<const Vec3> from, std::span<const Vec3> displacement,
                          std::span<Vec3> velocity, std::span<std::uint8_t> touched);

  // Marks all of an island if one of it is marked. True if none of these is fixed in space.
  bool spread(std::span<std::uint8_t> marks);

  // Scales displacements; the first call of a step gives those of which they are fractions.
  void share(std::span<const Vec3> goal);
  void join(const std::array<int, 4>& ids, double s);  // a hit at the share s of displacements
  bool slow(std::span<const std::uint8_t> which);      // false where none of these moves any more
  // displacement := the scaled one, projected. False if a colliding island has stopped: culprit().
  bool apply(std::span<const Vec3> from, std::span<Vec3> displacement,
             std::span<std::uint8_t> touched, std::span<std::uint8_t> dirty);
  void share_velocities(std::span<Vec3> velocity);  // of slowed islands
  int culprit() const { return culprit_; }
  bool shares() const { return sharing_; }  // in this step

  // Stores the internal variables of the constraints at this state.
  void follow(double* x_next) const;

 private:
  struct Sum {  // of the root of an island
    Vec3 moment{};
    double mass = 0, share = 1;
    int slowed = 0;
    bool shorter = false, met = false, bound = false, marked = false;
  };

  int root(int i) { return joined_.root(i); }
  void unite(int a, int b);
  void find_islands();
  bool slow_met();
  void add_up(std::span<const Vec3> of);
  Vec3 shared(int i, const Vec3& of);  // the share of a displacement or velocity
  void load(std::span<const Vec3> from, std::span<const Vec3> displacement);

  Particles* particles_;
  ConstraintSystem* constraint_system_;
  double t_ = 0, t_end_ = 0;
  Array start_, end_;                     // states
  bool near_ = false;                     // factors are of a state near the end
  bool found_ = false, sharing_ = false;  // the islands; some are slowed
  DisjointSets joined_;
  std::vector<Sum> sums_;
  std::vector<Vec3> goal_;
  RowValues rows_;
  int culprit_ = -1;
};

}  // namespace sim
