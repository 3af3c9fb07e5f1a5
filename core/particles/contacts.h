// What colliders do to the way of one particle through a step.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/particles/collider.h"
#include "core/particles/contact_ledger.h"

namespace sim {

// p(s) = c0 + c1 s + c2 s^2 + c3 s^3 for 0 <= s <= 1, in units of the step; what touches have
// changed at its end.
struct Way {
  Vec3 c[4];
  Vec3 moved{0, 0, 0};   // m, of the end
  Vec3 kicked{0, 0, 0};  // m a step, of the velocity at the end
  Vec3 held{0, 0, 0};    // where it sticks to a surface at the end
  bool touched = false, pressed = false, stuck = false, squeezed = false;
  ContactWork work = {};

  Vec3 at(double s) const { return c[0] + s * (c[1] + s * (c[2] + s * c[3])); }
  Vec3 rate(double s) const { return c[1] + s * (2 * c[2] + 3 * s * c[3]); }
  double length() const { return c[1].norm() + 2 * c[2].norm() + 3 * c[3].norm(); }  // at most

  void shift(const Vec3& by);                      // all of it
  void kick(double s, const Vec3& change);         // the velocity from s on
  void press(double s, const Vec3& acceleration);  // constant from s on
};

// Touches inside a step, of second order in the step whatever the method: the touch is found on the
// particle's own way, Newton's restitution and Coulomb's friction act there, and a particle that
// would be inside at the end all the same is pressed on from there on, as by a multiplier along the
// normal and friction against the slip: in the first half of what is left of the step here, in the
// second at its end, by hold(). Moreau (1988); Kaufman & Pai (2012), SIAM J. Sci. Comput. 34(6).
class Contacts {
 public:
  // Throws Error{kScene} with the first of the free particles [0, count), or of all, that is inside
  // at the start.
  void add(std::unique_ptr<Collider> collider, const std::string& name, const ParticleView& initial,
           int count = -1);

  // Those that were added as number so and so; the others act.
  void set_off(std::span<const std::size_t> colliders);

  bool empty() const noexcept { return on_.empty(); }
  std::span<Collider* const> all() const { return on_; }  // that act
  const std::vector<std::string>& notes() const { return notes_; }
  std::vector<SolidShape> shapes(double t) const;     // in the order they were added
  ContactLedger& ledger() const { return *ledger_; }  // where there are any

  bool move() const noexcept { return move_; }  // some of them
  // Before a step from t0 to t1, on one thread, where sampled().
  bool sampled() const noexcept { return sampled_; }
  void look(double t0, double t1) const;

  // True when a way of a step from t on, at most `length` long, that ends in the box middle -+ half
  // may touch something.
  bool near(double t, double h, const Vec3& middle, const Vec3& half, double length) const;

  // Changes the way of a step from t on so that it ends outside of all colliders, or is squeezed.
  void settle(double t, double h, Way& way) const;

  // v := the velocity of a particle that is pressed on at x, without what leads inside and with the
  // friction of that.
  Vec3 hold(double t, const Vec3& x, Vec3 v, ContactWork& work) const;

 private:
  void add_one(std::unique_ptr<Collider> collider, const std::string& name,
               const ParticleView& initial, int count);

  struct Entry {
    std::unique_ptr<Collider> collider;
    std::size_t part;  // a side of the one that was added as number so and so
  };
  std::vector<Entry> entries_, bodies_;  // bodies: those that act by their sides, to be drawn
  std::vector<Collider*> on_;
  std::vector<std::size_t> off_;
  std::size_t parts_ = 0;
  std::vector<std::string> notes_;
  std::unique_ptr<ContactLedger> ledger_;
  bool sampled_ = false, move_ = false;
};

}  // namespace sim
