// The impulses at which bodies that touch neither sink in nor slip more than friction lets them.
#pragma once

#include <span>
#include <vector>

#include "core/math/mat3.h"
#include "core/particles/contact_law.h"

namespace sim {

// What moves: a rigid body or a particle at the end of a step. Infinite mass: inverse_mass 0.
struct Mover {
  double inverse_mass = 0;  // 1/kg
  Mat3 inverse_inertia;     // in space, 1/(kg m^2)
  Vec3 velocity, spin;      // m/s, rad/s
  Vec3 shift, turn;         // m, rad: what the impulses so far have moved it
};

// One point where two of them touch; a second of -1 is what no impulse moves.
struct Meet {
  int first = 0, second = -1, feature = 0;
  int key1 = 0, key2 = 0;   // of what these are, the same from step to step
  Vec3 normal, arm1, arm2;  // to the first; from the centers of mass, m
  Vec3 ground;              // velocity of what does not move, m/s
  double gap = 0;           // m, at the end of the free step
  double tiny = 0;          // m: a gap that is none
  // The motion in which hits are looked for: the free one, but without forces where they touch from
  // the start, since what holds them there takes up forces.
  double path_gap = 0, path_gain = 0;    // m, at the end; m/s, not counted in the rate there
  double acceleration = 0;               // m/s^2
  double friction = 0, restitution = 0;  // of rest, at the slip at hand; of a slow blow
  Surface sides[2];                      // where one has a law that is not Coulomb's
  double before = 0;  // m/s, the normal velocity just before they touch; < 0: nearing
  double after = 0;   // s, from the touch to the end of the step
  double lever = 0;   // s: an impulse p moves the gap by lever * p / mass
  bool active = false;
  Vec3 u, v;                      // directions along the surface
  double soft_n = 0, soft_t = 0;  // 1/kg, along the normal and, at most, along the surface
  double push = 0, pull_u = 0, pull_v = 0;  // N s, of resting contact
  Vec3 pull;                                // N s, the last two in space, to begin with
  double given = 0;                         // m/s, gained by forces after the touch
  double offset = 0;                        // what rests is 0 <= normal velocity + offset
  int collider = -1;                        // what does not move

  bool has_law() const { return sides[0].law || sides[1].law; }
  // Of both sides: the larger restitution, the geometric mean of friction; at speeds in m/s.
  double restitution_at(double approach) const;
  double friction_at(double slip) const;
};

// What besides contact joins movers.
class MoverLinks {
 public:
  virtual ~MoverLinks() = default;
  // Velocities := the nearest that the links allow; change_alone: of changes of them.
  virtual void hold(std::span<Mover> movers, bool change_alone) = 0;
};

// How long before the end of a step of h a gap closed that is `gap` then, changes by `rate` and has
// had the acceleration a: gap - rate s + a s^2 / 2 = 0.
double time_since(double gap, double rate, double a, double h);

class Impulses {
 public:
  // Those that all that follows keeps to; null: none.
  void keep_to(MoverLinks* links) { links_ = links; }

  // Sizes and directions of a meeting; its active ones take part in what follows.
  void prepare(std::span<Mover> movers, std::span<Meet> meets) const;

  // What bounces in a step of h, in the order of time, also what earlier impulses bring to touch:
  // each by the laws of its sides. At one moment pair by pair in their order, again
  // and again, until none comes nearer. So a push runs along a row of balls, as in Newton's cradle,
  // whatever is between them.
  void bounce(std::span<Mover> movers, std::span<Meet> meets, double h);

  // What impulses made of the gap at the end of the step, m.
  static double moved(std::span<const Mover> movers, const Meet& meet);

  // What rests: 0 <= push, 0 <= normal velocity, one of them 0, and |pull| <= friction * push,
  // along the slip where that is an equation (Moreau (1988); Jean (1999)). Projected Gauss-Seidel,
  // forwards and backwards, from the impulses at hand, which start() applies; every few sweeps the
  // equations of all that then sticks are solved together by conjugate gradients (Silcowitz,
  // Niebuhr & Erleben (2010), Visual Computer 26, 893-901). Until a sweep changes no velocity by
  // more than `tolerance`, m/s. Returns the last change.
  void start(std::span<Mover> movers, std::span<const Meet> meets) const;
  double rest(std::span<Mover> movers, std::span<Meet> meets, double tolerance);

  // An impulse p on the first, -p on the second, and what it moves.
  static void apply(std::span<Mover> movers, const Meet& meet, const Vec3& p, double lever);
  static Vec3 velocity(std::span<const Mover> movers, const Meet& meet);  // of the first, relative

 private:
  struct Search {
    Vec3 before, found, rest, way, image;  // of one meeting, along its normal, u and v
    bool push = false, pull = false;
  };
  double linked_softness(std::span<const Mover> movers, const Meet& m);
  // How long before the end of the step, s, it is hit next, `now` at most; below 0: not at all.
  static double next_touch(std::span<const Mover> movers, const Meet& m, double now,
                           double fastest);
  double sweep(std::span<Mover> movers, std::span<Meet> meets) const;
  void stick(std::span<Mover> movers, std::span<Meet> meets, double tolerance);
  void set_back(std::span<Mover> movers, std::span<Meet> meets) const;

  MoverLinks* links_ = nullptr;
  std::vector<Search> search_;
  std::vector<Mover> scratch_;
};

}  // namespace sim
