// Contact of rigid bodies with colliders, each other and particles, between steps of any method.
#pragma once

#include <optional>
#include <utility>

#include "body_joints.h"
#include "core/particles/explicit/settling.h"
#include "impulses.h"
#include "solids.h"

namespace sim {

// A method makes a step from x to x_next as if nothing touched; resolve() then adds the impulses of
// what does. Each acts at the moment of its touch: of what hits, where the gap closes inside the
// step, by Newton's law of restitution; of what rests, as a constant force through the step. So a
// stack at rest keeps its velocities and places to rounding, and bounces and slides are of order 2
// in uniform gravity. What overlaps all the same, by what turns leave, is moved apart, in place and
// not in velocity. Impulses of rest begin with those of the step before: memory(). Of two surfaces
// friction is the geometric mean, restitution the larger; a particle has those of what it touches.
class RigidContact {
 public:
  static constexpr double kNoGap = 1e-8;  // of a radius: a gap that is none

  // holding: what else joins them, null: nothing; particles are settled then.
  RigidContact(Solids solids, Particles& particles, Holding* holding = nullptr);

  // True where it changed x_next. Without `holding` it settles single particles among colliders.
  bool resolve(double t, double h, const double* x, double* x_next);
  // Why the last step has no end; empty where it has one.
  const std::string& refusal() const { return refusal_; }

  const Solids& solids() const { return solids_; }
  // The impulses of the last step, for those of the next.
  static constexpr std::size_t kNumbers = 7;  // of each point
  std::vector<double> memory() const;
  void recall(std::span<const double> memory);
  void forget() { kept_.clear(); }

  double take_work();  // J, that contact took since the last call

  struct Counts {
    int most = 0;          // points that touched at once
    double fastest = 0;    // m/s, of what touched
    double unsettled = 0;  // m/s, the last change of the solver where it did not get to its end
  };
  const Counts& counts() const { return counts_; }

 private:
  struct Kept {
    int first, second, feature;  // keys of movers; second: of a collider -1 - its number
    Vec3 pull;                   // N s
    double push;
  };
  struct Reach {  // of one mover in one step
    RigidState before, after;
    double radius = 0, way = 0;  // m, around the center of mass; the longest of any point
    double scale = 0;            // m, what small gaps are measured by
    double lever = 0;            // s: a force through the step moves it by lever * its velocity
    double gained = 0;           // (m/s)^2: what forces and constraints made of its velocity
    bool fixed = false;          // one of its particles is pinned
  };
  struct Step {
    double t, h;
    const double *x, *x_next;
  };
  int key(int mover) const;  // of a body its number, of a particle its id behind those
  void load(const Step& step);
  void measure(Reach& reach, double h) const;
  int enter(int particle, int body, const Step& step);
  void find(const Step& step);
  void find_pairs();
  void find_particles(int body, const Step& step);
  template <class Touching>
  void meet(int first, int second, int collider, double margin, const Step& step,
            const Touching& touching);
  void add_meet(const TouchPoint& point, int first, int second, int collider, const Step& step,
                double left);
  void remember(Meet& meet) const;
  double solve(double h);
  void link_moves();
  void separate(double t);
  void store(double* x_next);
  void keep();

  Solids solids_;
  Particles* particles_;
  std::optional<Settling> settling_;  // of single particles, where there are colliders
  Impulses impulses_;
  std::unique_ptr<BodyJoints> joints_;  // where there are others than bodies have alone
  std::vector<int> entered_;            // particles that are movers in this step, behind the bodies
  std::vector<int> mover_of_;           // of each single particle, -1: none
  double fastest_single_ = 0;           // m/s
  double passed_on_ = 0;  // m: the longest way of a body that bounces, which others may go for it
  std::vector<Reach> reach_;  // of movers
  std::vector<Mover> movers_, moves_;
  std::vector<int> order_;                  // bodies from left to right
  std::vector<std::pair<int, int>> pairs_;  // of bodies that are near, ascending
  std::vector<Meet> meets_, overlaps_;
  std::vector<TouchPoint> points_;
  std::vector<Kept> kept_;
  std::string refusal_;
  double work_ = 0;  // J
  Counts counts_;
};

}  // namespace sim
