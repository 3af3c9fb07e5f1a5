// Surfaces push particles that constraints join: both are found together.
#pragma once

#include <algorithm>
#include <vector>

#include "core/particles/collider.h"
#include "core/particles/constraints/constraints.h"
#include "core/particles/constraints/row_matrix.h"

namespace sim {

inline constexpr double kFlush = 1e-9;  // of the size of a place, or of velocities: what is none
// A particle and a surface that it touches, or may touch.
struct Push {
  int particle = 0;
  Collider* collider = nullptr;
  Vec3 normal{0, 1, 0};  // along which it pushes
  Vec3 ground{0, 0, 0};  // of velocities: that of the surface, m/s
  double least = 0;      // of velocities: what is wanted along the normal, m/s
  double friction = 0;   // Coulomb's coefficient
  double spare = 0;      // what friction may do besides, in the unit of force; may be < 0
  bool acts = false, held = false;  // now; even where it would have to pull
  int changes = 0;                  // from acting to not acting
  double gap = 0;                   // just now
  double force = 0;                 // what was found: along the normal, in kg times the unit of y
  Vec3 pull{0, 0, 0};               // and along the surface
  Vec3 rubbed{0, 0, 0};             // N s, by friction in the first half of a piece
  double pressed = 0;               // N s, in a piece by what presses it besides

  double most_pull() const { return std::max(0.0, friction * std::max(0.0, force) + spare); }
};

// y := y + W (J^T mu + sum of pushes), such that rows and surfaces have what they want:
//   row(y) = 0,  0 <= force, 0 <= gap(y), one of them 0,
//   pull = -most_pull slip / |slip|, or less where the slip y - ground along the surface is 0
// A particle that is pushed moves along its surface only: what is left of the gradients there makes
// the matrix of multipliers, whose pattern stays that of the rows. Which surfaces push is found by
// primal-dual active sets (Hintermueller, Ito & Kunisch (2002), SIAM J. Optim. 13, 865-888).
// Friction is viscous, pull = -k slip, with a k that comes from what was found before (Chan & Mulet
// (1999), SIAM J. Numer. Anal. 36, 354-367): so it never gives energy, wherever the turns end.
class PushSolver {
 public:
  using Axes = Constraints::Axes;

  // What is wanted of y, asked again and again.
  struct Wanted {
    virtual ~Wanted() = default;
    virtual bool rows(std::span<double> rest) = 0;      // what is wrong; false: not finite
    virtual double gap(Push& push, const Vec3& y) = 0;  // along its normal
    double row_tolerance = 0, gap_tolerance = 0;        // what is none
    double enough = 0;     // what is good enough where turns gain no more
    double slow = 1;       // a slip that is none
    bool nearest = false;  // gradient and normals are those of y now, and damped
  };

  explicit PushSolver(const Constraints& constraints);

  // pushes: of one particle behind each other. gradient: J. False where no such y was found; then
  // y is what came last, and worst() what is wrong there.
  bool solve(std::span<Push> pushes, std::span<const Vec3> gradient, const Axes& y, Wanted& wanted);
  // Goes on where solve() stopped, with changed pushes.
  bool go_on(std::span<Push> pushes, std::span<const Vec3> gradient, const Axes& y, Wanted& wanted);

  struct Worst {
    double row = 0, gap = 0;
    int row_id = -1;
  };
  const Worst& worst() const { return worst_; }
  std::span<const double> multipliers() const { return mu_; }  // in kg times the unit of y
  Vec3 added(int i) const { return vector_of(added_, i); }     // to y of one particle

 private:
  struct Group {  // the pushes on one particle
    int particle = 0;
    std::size_t begin = 0, end = 0;
    int rank = 0;
    Vec3 basis[3];           // of the normals of those that act
    std::size_t of[3] = {};  // and the push that each is of
    double viscosity = 0;    // k, kg
    double mobility = 1;     // 1 / (1 + k / m), along the surface
  };
  struct Moved {
    double most = 0;       // of one particle
    bool changed = false;  // what pushes
    bool rubs = false;     // some have friction
  };

  Vec3 vector_of(const std::vector<double>& field, int i) const;
  void add_to(std::vector<double>& field, int i, const Vec3& by) const;
  void gather(std::span<Push> pushes);
  void span_normals(Group& group, std::span<const Push> pushes) const;
  void weigh(const Group& group, std::span<Push> pushes, const Vec3& force) const;
  Moved shift(std::span<Push> pushes, const Axes& y, Wanted& wanted, bool late);
  void make_viscous(Group& group, double most, double slip, double slow) const;
  void project(std::span<const Vec3> gradient, double shift);
  void take(std::span<const Vec3> gradient, const Axes& y);
  Vec3 along(const Group& group, const Vec3& v) const;

  const Constraints* constraints_;
  RowMatrix matrix_;
  std::vector<Group> groups_;
  std::vector<int> group_of_;                               // of each particle, -1: none
  std::vector<Vec3> projected_;                             // gradients along the surfaces
  std::vector<double> rest_, mu_, base_, added_, by_rows_;  // two of rows, three of particles
  double largest_ = 0;                                      // of the forces
  Worst worst_;
};

}  // namespace sim
