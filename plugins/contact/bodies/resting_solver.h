// Resting contact of bodies, island by island.
#pragma once

#include <span>
#include <vector>

#include "contact_solver.h"
#include "core/base/thread_pool.h"

namespace sim {

// Solves 0 <= normal impulse, 0 <= normal velocity, one of them 0, and |tangent impulse| <=
// friction * normal impulse, opposite to the slip where that is an equation (Moreau (1988); Jean
// (1999)). Bodies that contacts join are an island, which no other can move; fixed bodies and
// colliders join none. Each island is solved by itself until a sweep changes none of its velocities
// by more than a tolerance: projected Gauss-Seidel, forwards and backwards, from the present
// impulses; every few sweeps the equations of all sticking contacts are solved together by
// conjugate gradients (Silcowitz, Niebuhr & Erleben (2010), Visual Computer 26, 893-901). The same
// bits on any number of threads.
class RestingSolver {
 public:
  // The joints that all impulses respect; null: none. With joints all bodies are one island.
  void set_joints(JointProjection* joints) { joints_ = joints; }

  // From the impulses of the active contacts, which the velocities of the bodies have felt. What
  // these add moves the bodies, too. tolerance: m/s. Returns the largest last change, above the
  // tolerance where the work has found its bound before.
  double solve(std::span<SolverBody> bodies, std::span<ContactPoint> contacts, double tolerance,
               ThreadPool& pool);

 private:
  struct Direction {
    Vec3 along, moment[2], turn[2];  // arm x along, and I^-1 of it, of both bodies
    double ground = 0;               // m/s, of a collider
  };
  struct Row {
    int first = 0, second = -1;
    std::size_t contact = 0;
    double inverse_mass[2] = {};
    Direction direction[3];               // the normal, u and v
    double inverse_n = 0, inverse_t = 0;  // 1/kg, as of ContactPoint
    double friction = 0, offset = 0;
    Vec3 impulse;  // N s, along the three
  };
  struct Search {
    Vec3 before, found, rest, direction, image;  // along the three
    bool pushes = false, sticks = false;
  };
  struct Island {
    std::size_t begin = 0, end = 0;  // of its rows
    std::vector<int> bodies = {};    // that move
    std::size_t work = 0;            // rows visited
  };
  using Bodies = std::span<SolverBody>;

  void find_islands(Bodies bodies, std::span<const ContactPoint> contacts);
  int root_of(int body);
  void add_row(Bodies bodies, const ContactPoint& contact, std::size_t index, Row& row) const;
  double solve_island(Bodies bodies, Island& island, double tolerance);
  double sweep(Bodies bodies, Island& island);
  void solve_sticking(Bodies bodies, Island& island, double tolerance);
  void restore(Bodies bodies, Island& island);
  void store(Bodies bodies, std::span<ContactPoint> contacts) const;

  static double rate(std::span<const SolverBody> bodies, const Row& row, std::size_t k);
  static void apply(Bodies bodies, const Row& row, std::size_t k, double impulse);
  static void change(Bodies bodies, Row& row, const Vec3& impulse);

  JointProjection* joints_ = nullptr;
  std::vector<Row> rows_;          // of active contacts, one island behind the other
  std::vector<Search> search_;     // of each row
  std::vector<SolverBody> trial_;  // of conjugate gradients
  std::vector<Island> islands_;
  std::size_t count_ = 0;  // of the islands in use
  std::vector<int> parent_, island_of_;
  std::vector<double> changes_;  // of each island
};

}  // namespace sim
