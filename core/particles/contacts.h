// The effect of colliders on the path of one particle through a step.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/particles/collider.h"
#include "core/particles/contact_work_sums.h"
#include "core/particles/step_path.h"

namespace sim {

// The accuracy of particle contact: resolved inside a step; projected at its end, which is of first
// order, for comparison; or by steps that end at each impact, with the full order of a method.
enum class Accuracy { kSettle, kProject, kEvent };

// Contact inside a step, of second order in the step whatever the method. The impact is found on
// the particle's own path, and restitution and friction act there. A particle that would still
// penetrate at the end is a resting contact from there on: a multiplier acts along the normal and
// friction against the slip, for the first half of the rest of the step here, for the second at its
// end by constrain_velocity(). Moreau (1988); Kaufman & Pai (2012), SIAM J. Sci. Comput. 34(6).
class Contacts {
 public:
  // Throws Error{kScene} with the first of the free particles [0, count) that penetrates at the
  // start.
  void add(std::unique_ptr<Collider> collider, const std::string& name, const ParticleView& initial,
           int count);

  // Turns off the colliders that were added under these numbers, ascending, and all others on.
  void set_off(std::span<const std::size_t> colliders);

  void set_accuracy(Accuracy accuracy) { accuracy_ = accuracy; }  // kSettle before that
  Accuracy accuracy() const noexcept { return accuracy_; }

  bool empty() const noexcept { return on_.empty(); }
  std::span<Collider* const> all() const { return on_; }  // that act
  const std::vector<std::string>& notes() const { return notes_; }
  std::vector<RenderShape> shapes(double t) const;            // in the order they were added
  ContactWorkSums& work_sums() const { return *work_sums_; }  // null without colliders

  bool move() const noexcept { return move_; }  // some of them
  // Called before a step from t0 to t1, on one thread, if sampled().
  bool sampled() const noexcept { return sampled_; }
  void prepare_interval(double t0, double t1) const;

  // True when a path of a step from t on, at most `length` long, that ends in the box middle -+
  // half may touch a collider.
  bool near(double t, double h, const Vec3& middle, const Vec3& half, double length) const;

  // The time of impact of a path that begins outside, as a fraction of the step; 2: none.
  static double first_touch(const Collider& collider, double t, double h, const StepPath& path);
  // The velocity after an impact at x on a collider, m/s.
  static Vec3 bounced(const Collider& collider, double t, const Vec3& x, const Vec3& v,
                      ContactWork& work);

  // Changes the path of a step from t on so that it ends outside of all colliders, or is
  // over-constrained.
  void resolve(double t, double h, StepPath& path) const;

  // The first impact of a path with a collider that is not among the `known` resting contacts, with
  // restitution and friction; false if there is none.
  struct Impact {
    Collider* collider = nullptr;
    double s = 0;           // share of the step
    Vec3 place{0, 0, 0};    // there, on the surface
    Vec3 change{0, 0, 0};   // m a step, of the velocity from there on
    Vec3 shift{0, 0, 0};    // m, of a particle put inside by a user
    ContactWork work = {};  // (m/step)^2
  };
  bool impact(double t, double h, const StepPath& path, std::span<Collider* const> known,
              Impact& impact) const;
  // The gap below which a particle rests on the surface, given the rounding of its coordinates.
  static double slack(const Vec3& x);
  // Moves a position out of all colliders; false if it is over-constrained.
  bool push_out(double t, Vec3& x) const;
  // The nearest velocity that leads into none of the surfaces within `reach` of x, for where that
  // of one after the other does not get there; false if there is none.
  bool lead_between(double t, const Vec3& x, double reach, Vec3& v, ContactWork& work) const;

  // The same for particle i: writes its position (m) and velocity (m/s) at the end of the step, and
  // adds to the work sums; `hold_too`: then constrain_velocity(). False if it touched nothing.
  bool resolve(double t, double h, int i, double mass, bool hold_too, StepPath& path, Vec3& place,
               Vec3& velocity) const;

  // The velocity v of a resting particle at x without its component into the surface, and with the
  // friction of that change.
  Vec3 constrain_velocity(double t, const Vec3& x, Vec3 v, ContactWork& work) const;
  Vec3 constrain_velocity(double t, int i, double mass, const Vec3& x,
                          const Vec3& v) const;  // into the ledger

 private:
  void turn_on(Collider& collider);
  void add_one(std::unique_ptr<Collider> collider, const std::string& name,
               const ParticleView& initial, int count);

  void project(double t, double h, StepPath& path) const;
  void push_end_out(double t, StepPath& path) const;
  bool push_between(double t, Vec3& x) const;  // out of all surfaces at once, or nowhere

  struct Entry {
    std::unique_ptr<Collider> collider;
    std::size_t part;  // a side of the one that was added as number so and so
  };
  std::vector<Entry> entries_, bodies_;  // bodies: drawn ones that act by their sides
  std::vector<Collider*> on_;
  std::vector<std::size_t> off_;
  std::size_t parts_ = 0;
  std::vector<std::string> notes_;
  std::unique_ptr<ContactWorkSums> work_sums_;
  bool sampled_ = false, move_ = false;
  Accuracy accuracy_ = Accuracy::kSettle;
};

}  // namespace sim
