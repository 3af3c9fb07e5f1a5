// Contact of an island by Newton's method, for islands whose sweeps converge slowly.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "block_lu.h"
#include "body_joints.h"
#include "contact_row.h"

namespace sim {

// Coulomb's law is p = P(p - s w(y)) for any s > 0 (Alart & Curnier (1991), Comput. Methods Appl.
// Mech. Eng. 92, 353-375): G is the Jacobian of all points in the metric of the masses, y = G^T p
// the motion by impulses p, w(y) the velocities of the points; P(a)_n = max(0, a_n), and P(a)_t is
// a_t within the friction P(a)_n.
//
// Proximal steps, p_{k+1} = P(p_k - s w(y)) with y = G^T p_{k+1} (Rockafellar (1976), SIAM J.
// Control Optim. 14, 877-898), solve an equation for y each, 6 numbers a body: F(y) = y - G^T P(p_k
// - s w(y)) = 0. Its Jacobian I + s G^T P' G is regular however many points are redundant, so that
// Newton's method converges (Qi & Sun (1993), Math. Program. 58, 353-367). s grows as long as that
// is quick. Joints are points of which P(a) = a.
class ProximalNewton {
 public:
  struct Goal {
    double tolerance = 0;       // m/s
    std::size_t factors = 400;  // the most factorisations
    double first_weight = 100;  // s of the first step; the nearer the solution, the larger it pays
  };
  struct Island {
    std::span<const ContactRow> rows;
    std::span<const int> bodies;          // that move
    std::span<const std::size_t> groups;  // of joints
    const BodyJoints* joints = nullptr;   // null: none
  };
  // Solves from the impulses of the rows, which are applied to the bodies, whose velocities the
  // joints allow. Returns the residual of impulses(), m/s, infinite if factorisation is too much
  // work.
  double solve(std::span<const SolverBody> bodies, const Island& island, const Goal& goal,
               const std::function<bool()>& gives_up);
  std::span<const Vec3> impulses() const { return best_; }  // of the rows

 private:
  struct Side {
    int node = 0;                          // a body of the island, or a particle behind those
    double row[3][BlockLu::kStride] = {};  // G: of each direction, for its velocity and rotation
  };
  struct Point {
    std::size_t sides = 0, count = 0, entries = 0;  // the first ones, and how many sides
    double friction = 0, step = 0;  // kg: s at the weight 1, the inverse of the mean response
    double scale = 0;               // of a joint: from its rate to m/s; 0: of contact
    Vec3 free;                      // m/s, without impulses
    Vec3 impulse, step_to, tried;   // N s: p_k, p_k - s w, and P(p_k - s w) at the last y
  };

  void load(std::span<const SolverBody> bodies, const Island& island);
  void load_contacts(std::span<const SolverBody> bodies, std::span<const ContactRow> rows);
  void load_joints(const JointGroup& group, int& nodes);
  void add_side(Point& point, int node, double inverse_mass, const Vec3 (&along)[3],
                const Vec3 (&moment)[3]);
  std::span<const Side> sides_of(const Point& point) const {
    return std::span(sides_).subspan(point.sides, point.count);
  }
  static Vec3 projected(const Point& point, Mat3* slope = nullptr);
  Vec3 velocity(const Point& point, std::span<const double> y) const;
  void add(const Point& point, const Vec3& impulse, std::span<double> y) const;
  double evaluate(std::span<const double> y, std::span<double> rest);
  void fill_matrix();
  bool find_motion(double tolerance, const std::function<bool()>& gives_up);
  double residual() const;

  std::span<const ContactRow> rows_;
  std::vector<Point> points_;  // of the rows, then of joints
  std::vector<Side> sides_;
  std::vector<std::size_t> entries_;  // of the matrix: each side of a point with each
  std::vector<Vec3> best_;
  std::vector<int> local_, particle_;  // the nodes of bodies, and of a group's single particles
  std::vector<double> y_, begin_, tried_y_, rest_, tried_rest_, step_, correction_;
  std::vector<std::array<int, 2>> pairs_;  // of nodes that share a point
  std::vector<Mat3> root_;                 // of the inverse inertia of each body
  BlockLu matrix_;
  double weight_ = 0;  // of s
  int solves_ = 0, left_ = 0;
};

}  // namespace sim
