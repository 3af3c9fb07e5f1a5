// Contact of surfaces with themselves, each other and rigid bodies, resolved so that none passes
// through another.
#pragma once

#include <memory>
#include <string>

#include "body_surfaces.h"
#include "constrained_islands.h"
#include "contact_impulses.h"
#include "core/particles/particles.h"
#include "impact_zones.h"
#include "pair_cache.h"
#include "self_collision_culling.h"
#include "surface_contact_spec.h"

namespace sim {

// Any method makes a step from x to x_next; resolve() then puts x_next back among the states that
// are reached without a crossing. Points move straight from x to x_next, in this order:
//   0. Where strain is limited, edges that would end too long get impulses along them.
//   1. Layers nearer than the thickness may not approach further, with friction, and are pushed
//      apart by a share of what they lack, in position and not in velocity.
//   2. Pairs that still hit get impulses along the normal at the time of impact, repeatedly.
//   3. The rest moves in impact zones, which keep only as much of their inner motion as is known
//      to be free, at last none (Bridson, Fedkiw & Anderson 2002; Provot 1997).
//   4. If that fails because particles are kinematic, the step is taken in substeps.
// With constraints, each round of impulses ends with a projection onto them, and islands that move
// a fraction of their step take the place of zones (ConstrainedIslands). A step ends only when no
// pair comes nearer than a share of the distance it began with. So by induction no surfaces that
// are apart at the start ever cross, whatever the step size. Velocities lose the components that
// bring layers closer; momentum is conserved, energy does not rise above that of the free step or
// the state before. A pure function of (t, h, x, x_next).
class SurfaceContact {
 public:
  // Throws Error{kScene} if surfaces cross or touch at the start, or if the thickness is more than
  // half of the shortest edge.
  SurfaceContact(SurfaceContactSpec spec, Particles& particles, ConstraintSystem* constraint_system,
                 const ParticleView& initial);

  // Keeps surfaces from crossing these bodies, which feel the contact. Throws Error{kScene} if some
  // cross or touch at the start.
  void keep_out_of(const BodyGeometry& bodies, const ParticleView& initial);

  // Opens surfaces between these pairs of particles. Replaces what was said before.
  void tear(std::span<const std::array<int, 2>> torn) {
    torn_.assign(torn.begin(), torn.end());
    pairs_.tear(torn);
  }

  // The reason why these positions are not allowed: two triangles, or one and a body, that cross or
  // touch. Empty if they are.
  std::string objection(const ParticleView& view);

  enum class Outcome { kFree, kChanged, kRefused };
  // kFree: x_next keeps its bits. kRefused: kinematic particles, or constraints that move, force
  // surfaces through each other; refusal() says where.
  Outcome resolve(Particles& particles, double t, double h, const double* x, double* x_next);
  const std::string& refusal() const { return refusal_; }
  // The energy, J, that contact took since the last call, with its part by late_work(). Contact
  // does not give back what the free step lost by its own error. With kinematic particles the step
  // may lose and contact give, in turns.
  double take_work(double late);

  struct Counts {
    std::int64_t steps = 0, pairs = 0, zones = 0;  // in which it acted; the most at once; in zones
    std::int64_t shortened = 0;                    // steps in which constrained islands were slowed
    double deepest = 0;                            // m, inside a collider, by contact of surfaces
  };
  const Counts& counts() const { return counts_; }

 private:
  SurfacePoints points();
  void load(const Particles& particles, const double* x, const double* x_next);
  double friction_of(const ContactRow& row, const ContactMaterial& surface) const;
  void make_rows();
  void add_row(const SurfacePair& pair, const Separation& apart, ContactRow& row);
  bool limit_strain();  // rows for edges that would end too long; whether there are any
  bool meet_colliders(Particles& particles, double t_end, std::span<const std::uint8_t> of);
  void find_hits(ThreadPool& pool, bool of_all);
  void add_hits();
  bool advance_rows(Particles& particles, double t_end);
  bool advance_zones(Particles& particles);
  bool advance(Particles& particles, double t_end);
  bool advance_substeps(Particles& particles, double t, double h);  // surface_contact_substeps.cpp
  void join_substeps();
  bool advance_constrained(Particles& particles, double t_end);  // see _constrained.cpp
  bool advance_shortened(Particles& particles);
  bool relax_constrained(Particles& particles, double t_end);
  void find_constrained_velocities();
  bool give_way(Particles& particles);
  bool changed(int i) const { return touched_[static_cast<std::size_t>(i)] != 0; }
  double least_rate(const Particles& particles, double t_end, const ContactRow& row) const;
  void find_velocities(Particles& particles, double t_end, double h);
  void write(Particles& particles, double* x_next) const;
  bool brake(double excess);
  void store(Particles& particles, double t, double h, const double* x, double* x_next);

  SurfaceContactSpec spec_;
  PairCache pairs_;
  std::optional<SelfCollisionCulling> sheet_;  // if the only surface is a sheet
  ContactImpulses impulses_;
  ImpactZones impact_zones_;
  std::unique_ptr<ConstrainedIslands> islands_;  // if there are constraints
  std::unique_ptr<BodySurfaces> bodies_;         // null without bodies in contact
  struct RowOfBody {
    std::size_t row;
    SurfacePair pair;
    Separation apart;
  };
  std::vector<RowOfBody> of_bodies_;
  std::vector<std::array<int, 2>> torn_;
  std::vector<int> movable_;  // particles that a step may change: of surfaces, or all
  std::vector<Vec3> first_, from_, displacement_, free_displacement_, ends_,
      velocity_;  // first_: at the start of the step
  std::vector<double> inverse_mass_, bounds_;
  std::vector<double> longest_;                // m, of edges; empty without a limit
  std::vector<std::uint8_t> touched_, dirty_;  // changed in this step; since the last test for hits
  std::vector<ProximityHit> hits_;
  bool collides_ = false;
  double work_ = 0;
  double span_ = 0;  // s, of the step
  bool kinematic_ = false;
  std::string refusal_;
  Counts counts_;
};

}  // namespace sim
