// Bodies and particles that constraints join, and the equations of their velocities.
#pragma once

#include <span>
#include <vector>

#include "contact_solver.h"
#include "core/linear/row_matrix.h"

namespace sim {

// Equations J v + drive = 0 between the velocities of rigid bodies and of particles. The gradients
// g of the four particles of a body act on it as it is rigid: sum g along its velocity, sum arm x g
// along its rotation. So the equations of rigidity are no part of it, and J W J^T has only the rows
// of joints, sparse: a chain or a tree takes time linear in its bodies.
class JointGroup {
 public:
  struct Term {  // of one equation and one member
    Vec3 along, moment;
  };
  // A solver body, or -1: a particle without one. To be set at each state.
  struct Member {
    int body = -1, particle = -1;  // of the system, one of them
    int place = -1;                // among the solver bodies
    double inverse_mass = 0;       // 1/kg
    Vec3 velocity = {}, moved = {},
         shift = {};  // without a place: m/s; m, of the moves at hand, and of all
  };

  // pattern: the members of each equation; rows: their rows in the system.
  JointGroup(std::vector<Member> members, RowPattern pattern, std::vector<int> rows);

  std::span<Member> members() { return members_; }
  std::span<const Member> members() const { return members_; }
  std::span<const int> rows() const { return rows_; }
  // To be set at each state, then factorise() follows.
  std::span<Term> terms() { return terms_; }
  std::span<const Term> terms() const { return terms_; }  // as the pattern has them
  const RowPattern& pattern() const { return pattern_; }
  std::span<double> drive() { return drive_; }
  void factorise(std::span<const SolverBody> bodies);

  // v := the nearest velocities that obey the equations, in the metric of the masses.
  enum class What { kVelocities, kChanges, kMoves, kDisplacements };  // the first with drive
  void project(std::span<SolverBody> bodies, What what);

 private:
  static RowPattern nodes_of(std::span<const Member> members, const RowPattern& pattern);

  std::vector<Member> members_;
  RowPattern pattern_;
  std::vector<int> rows_;
  std::vector<Term> terms_;
  std::vector<double> drive_, rest_, weights_;
  std::vector<Vec3> gradient_, change_;  // change_: of members without a place
  RowMatrix matrix_;                     // of two nodes a member, one moves along and one turns
};

}  // namespace sim
