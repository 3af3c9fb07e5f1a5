// Resting contact of bodies, island by island.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "contact_row.h"
#include "contact_solver.h"
#include "core/base/disjoint_sets.h"
#include "core/base/thread_pool.h"
#include "joint_group.h"
#include "proximal_newton.h"

namespace sim {

// Solves 0 <= normal impulse, 0 <= normal velocity, one of them 0, and |tangent impulse| <=
// friction * normal impulse, opposite to the slip where that is an equality (Moreau (1988); Jean
// (1999)). Bodies that contacts or joints join are an island; fixed ones and colliders join none.
// Each island is solved by itself by nonsmooth Gauss-Seidel: each point in turn gets the impulse
// that solves it alone (Jourdan, Alart & Jean (1998), Comput. Methods Appl. Mech. Eng. 155, 31-47),
// starting from the present impulses, with Anderson acceleration of the sweeps, and by
// ProximalNewton where these converge slowly. The residual is the largest velocity change, m/s,
// that a point alone still requires: 0 at the solution only. The bits are the same on any number of
// threads.
class RestingSolver {
 public:
  // The joints that all impulses respect; null: none.
  void set_joints(BodyJoints* joints) { joints_ = joints; }

  // Starts from the impulses of the active contacts, which are already applied to the bodies;
  // further impulses move the bodies too. tolerance: of the residual, m/s; rounding errors do not
  // count. Returns the largest residual, above the tolerance if an island has used up its sweeps.
  double solve(std::span<SolverBody> bodies, std::span<ContactPoint> contacts, double tolerance,
               ThreadPool& pool);

 private:
  struct Island {
    std::size_t begin = 0, end = 0;        // of its rows
    std::vector<int> bodies = {};          // that move
    std::vector<std::size_t> groups = {};  // of joints
  };
  struct Sweep {
    double residual = 0, rounding = 0;  // m/s, and its rounding error
  };
  using Bodies = std::span<SolverBody>;

  void find_islands(Bodies bodies, std::span<const ContactPoint> contacts);
  void project(Bodies bodies, const Island& island, JointGroup::What what);
  double solve_island(Bodies bodies, Island& island, double tolerance, ProximalNewton& newton,
                      const std::function<bool()>& gives_up);
  bool solve_by_newton(Bodies bodies, const Island& island, const ProximalNewton::Goal& goal,
                       double least, ProximalNewton& newton, const std::function<bool()>& gives_up);
  Sweep sweep(Bodies bodies, const Island& island);
  void store(Bodies bodies, const Island& island, std::span<ContactPoint> contacts) const;

  BodyJoints* joints_ = nullptr;
  std::vector<ContactRow> rows_;  // of active contacts, one island behind the other
  std::vector<double> unknowns_, images_, history_;  // of the mixing, of each row
  std::vector<Island> islands_;
  std::size_t count_ = 0;  // of the islands in use
  DisjointSets joined_;
  std::vector<int> island_of_;
  std::vector<double> residuals_;        // of each island
  std::vector<ProximalNewton> newtons_;  // of each thread
};

}  // namespace sim
