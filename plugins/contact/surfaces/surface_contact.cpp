#include "surface_contact.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/assert.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/particles/elements/mesh_intersections.h"

namespace sim {
namespace {

constexpr double kPush = 0.1;            // of the missing distance, in a step
constexpr int kImpulseRounds = 8;        // of impulses on displacements
constexpr int kSweeps[2] = {12, 6};      // of rows, in the first round and the later ones
constexpr int kHalvingsOfAll = 24;       // of the motion of all surfaces, against their energy
constexpr double kOpen = 0.2;            // thicknesses that neighbours of an open sheet are apart
constexpr double kFarthest = 1e100;      // m
constexpr double kContactInside = 1e-3;  // thicknesses that a particle may be inside a solid
constexpr double kSlack = 1e-3;          // of a distance: misses of this size stay
constexpr double kSlackOfBodies = 1e-3;  // of that
constexpr double kNoDistance = 1e-6;     // thicknesses: no distance

std::string named(const TriangleMesh::Triangle& t) {
  return "(" + std::to_string(t[0]) + ", " + std::to_string(t[1]) + ", " + std::to_string(t[2]) +
         ")";
}

constexpr const char* kPlaceApart = "place them apart: what is apart at the start stays so";

void refuse(const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"bad sim.contact", "", why, remedy});
}

std::vector<Vec3> places(const ParticleView& view) {
  std::vector<Vec3> list(slot(view.n));
  for (int i = 0; i < view.n; ++i) list[slot(i)] = view.position(i);
  return list;
}

// A triangle that has these particles.
TriangleMesh::Triangle triangle_with(const TriangleBvh& parts, std::span<const int> ids) {
  for (const TriangleMesh::Triangle& t : parts.triangles())
    if (std::ranges::all_of(ids, [&](int id) { return std::ranges::count(t, id) > 0; })) return t;
  return {};
}

}  // namespace

SurfaceContact::SurfaceContact(SurfaceContactSpec spec, Particles& particles,
                               ConstraintSystem* constraint_system, const ParticleView& initial)
    : spec_(std::move(spec)),
      pairs_(TriangleBvh(spec_.surfaces, spec_.self, places(initial)), spec_.thickness) {
  double edge = HUGE_VAL;
  for (const auto& [a, b] : pairs_.parts().edges()) {
    const double length = (initial.position(a) - initial.position(b)).norm();
    edge = std::min(edge, length);
    if (spec_.strain_limit > 0) longest_.push_back((1 + spec_.strain_limit) * length);
  }
  if (!(spec_.thickness <= 0.5 * edge))
    refuse("a thickness of " + shortest(spec_.thickness) +
               " m is more than half of the shortest edge, " + brief(edge) + " m",
           "give at most " + brief(0.5 * edge));
  if (const std::string why = objection(initial); !why.empty()) refuse(why, kPlaceApart);
  movable_.assign(pairs_.parts().vertices().begin(), pairs_.parts().vertices().end());
  if (constraint_system) {
    islands_ = std::make_unique<ConstrainedIslands>(particles, *constraint_system);
    movable_.resize(slot(initial.n));
    std::iota(movable_.begin(), movable_.end(), 0);
  }
  if (spec_.surfaces.size() == 1)
    if (const auto grid = sheet_of(*spec_.surfaces[0])) sheet_.emplace(*grid);
}

void SurfaceContact::keep_out_of(const BodyGeometry& bodies, const ParticleView& initial) {
  SIM_ASSERT(islands_);  // a body is constrained itself
  bodies_ = std::make_unique<BodySurfaces>(bodies, initial.n);
  pairs_ = PairCache(
      TriangleBvh(spec_.surfaces, spec_.self, bodies_->places(initial), bodies_->elements()),
      spec_.thickness);
  if (const std::string why = objection(initial); !why.empty()) refuse(why, kPlaceApart);
}

SurfacePoints SurfaceContact::points() {
  const SurfacePoints particles{from_, displacement_, dirty_};
  return bodies_ ? bodies_->points(particles) : particles;
}

std::string SurfaceContact::objection(const ParticleView& view) {
  MeshIntersections crossings(spec_.surfaces);
  crossings.tear(torn_);
  if (const auto pair = crossings.first(view); !pair.empty())
    return "triangles " + named(pair[0]) + " and " + named(pair[1]) + " cross";
  const std::vector<Vec3> at = bodies_ ? bodies_->places(view) : places(view);
  TriangleBvh parts(spec_.surfaces, spec_.self, at, bodies_ ? bodies_->elements() : BodyElements{});
  parts.tear(torn_);
  if (bodies_)
    if (const auto found = bodies_->crossing(parts, at))
      return "triangle " + named(found->first) + " and body " + std::to_string(found->second) +
             " cross";
  std::vector<Aabb> boxes;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Vec3 side =
        Vec3::Constant(kNoDistance * spec_.thickness + parts.radius(static_cast<int>(i)));
    boxes.push_back({at[i] - side, at[i] + side});
  }
  std::vector<SurfacePair> near;
  ThreadPool pool(1);
  parts.find_pairs(boxes, pool, near);
  const auto name = [&](std::span<const int> side) {
    return side[0] < view.n ? "triangle " + named(triangle_with(parts, side))
                            : "body " + std::to_string(bodies_->body_of(side[0]));
  };
  for (const SurfacePair& pair : near) {
    const auto [a, b, c, d] = pair.ids;
    const FourPoints p{at[slot(a)], at[slot(b)], at[slot(c)], at[slot(d)]};
    if (separation_of(pair.kind, p).gap - parts.radius(pair) > kNoDistance * spec_.thickness)
      continue;
    const std::size_t first = pair.kind == PairKind::kEdgeEdge ? 2 : 1;
    return name(std::span(pair.ids).first(first)) + " and " +
           name(std::span(pair.ids).subspan(first)) + " touch";
  }
  return {};
}

double SurfaceContact::take_work(double late) {
  const double work = std::exchange(work_, 0.0) + late;
  return std::exchange(kinematic_, false) ? work : std::max(0.0, work);
}

void SurfaceContact::load(const Particles& particles, const double* x, const double* x_next) {
  const auto n = slot(particles.layout().n());
  const auto p = particles.layout().axes(x), q = particles.layout().axes(x_next);
  from_.resize(n);
  displacement_.resize(n);
  inverse_mass_.resize(n);
  for (const int i : movable_) {
    from_[slot(i)] = {p[0][i], p[1][i], p[2][i]};
    displacement_[slot(i)] = Vec3(q[0][i], q[1][i], q[2][i]) - from_[slot(i)];
    inverse_mass_[slot(i)] = 1 / particles.masses()[slot(i)];
  }
}

// The friction coefficient at the mean slip of the free step.
double SurfaceContact::friction_of(const ContactRow& row, const ContactMaterial& surface) const {
  if (!surface.law) return surface.friction;
  Vec3 slip = Vec3::Zero();
  for (std::size_t k = 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k)
    slip += row.weights[k] * free_displacement_[slot(row.ids[k])];
  return surface.friction_at(tangential(slip, row.normal).norm() / span_);
}

void SurfaceContact::make_rows() {
  pairs_.each_near([&](std::size_t pair, const Separation& start) {
    const double lack = std::max(spec_.thickness - start.gap, 0.0);
    const double keep = start.gap + kPush * lack;
    ContactRow row{.normal = start.normal};
    row.bound = std::min(keep, spec_.thickness) - start.gap;
    row.slack = kSlack * std::min(start.gap, spec_.thickness);
    row.gap = std::min(keep, spec_.thickness);
    add_row(pairs_.pairs()[pair], start, row);
  });
}

// Adds a row of a pair. The point of a body in the middle of its displacement is the one that does
// not move along the normal as it turns.
void SurfaceContact::add_row(const SurfacePair& pair, const Separation& apart, ContactRow& row) {
  const bool of_body = bodies_ && bodies_->is_part(pair);
  if (of_body) {
    bodies_->extend(pair, apart, 0.5, row);
    row.slack *= kSlackOfBodies;
    of_bodies_.push_back({impulses_.rows().size(), pair, apart});
  } else {
    std::ranges::copy(pair.ids, row.ids.begin());
    std::ranges::copy(apart.weights, row.weights.begin());
  }
  row.friction = friction_of(row, of_body ? bodies_->material(pair) : spec_.material);
  impulses_.add(row, inverse_mass_);
}

bool SurfaceContact::limit_strain() {
  bool any = false;
  for (std::size_t e = 0; e < longest_.size(); ++e) {
    if (pairs_.parts().edge_gone(e)) continue;
    const auto [a, b] = pairs_.parts().edges()[e];
    const Vec3 start = from_[slot(b)] - from_[slot(a)];
    const Vec3 end = start + (displacement_[slot(b)] - displacement_[slot(a)]);
    if (!(end.squaredNorm() > longest_[e] * longest_[e] * (1 + 4 * kSlack))) continue;
    ContactRow row{.normal = end.normalized()};
    row.ids[0] = a, row.ids[1] = b;
    row.weights[0] = 1, row.weights[1] = -1;
    row.bound = row.normal.dot(start) - longest_[e];
    row.slack = kSlack * longest_[e];
    row.gap = longest_[e];
    impulses_.add(row, inverse_mass_);
    any = true;
  }
  return any;
}

// Adds rows for particles that would end inside a collider, along its normal. True if there are
// any.
bool SurfaceContact::meet_colliders(Particles& particles, double t_end,
                                    std::span<const std::uint8_t> of) {
  bool any = false;
  for (const int i : pairs_.parts().particles()) {
    if (!of[slot(i)] || inverse_mass_[slot(i)] == 0) continue;
    for (Collider* const collider : particles.contacts().all()) {
      const SurfaceSample sample = collider->query(t_end, from_[slot(i)] + displacement_[slot(i)]);
      if (!(sample.gap < -kContactInside * spec_.thickness)) continue;
      ContactRow row{.weights = {1}, .normal = sample.normal};
      row.ids[0] = i;
      row.bound = sample.normal.dot(displacement_[slot(i)]) - sample.gap;
      row.slack = 0.1 * kContactInside * spec_.thickness;
      impulses_.add(row, inverse_mass_);
      any = true;
    }
  }
  return any;
}

// Rounds displacements as x_next stores them, and finds the hits of dirty particles, or of all.
void SurfaceContact::find_hits(ThreadPool& pool, bool of_all) {
  for (const int i : movable_)
    if (dirty_[slot(i)])
      displacement_[slot(i)] = (from_[slot(i)] + displacement_[slot(i)]) - from_[slot(i)];
  SurfacePoints at = points();
  if (pairs_.follow(at, pool) || of_all) {
    std::ranges::fill(dirty_, std::uint8_t{1});
    at = points();
  }
  pairs_.find_hits(at, pool, hits_);
}

// Adds rows for hits, along the normal at the time of impact.
void SurfaceContact::add_hits() {
  const SurfacePoints at = points();
  for (const ProximityHit& met : hits_) {
    const SurfacePair& pair = pairs_.pairs()[met.pair];
    ContactRow row{.normal = met.then.normal};
    row.slack = kSlack * std::min(met.gap_start, spec_.thickness);
    row.gap = std::min(met.gap_start, spec_.thickness);
    row.bound = row.gap + pairs_.parts().radius(pair);
    for (std::size_t k = 0; k < 4; ++k)
      row.bound -= met.then.weights[k] *
                   row.normal.dot(at.from[slot(pair.ids[k])] - at.from[slot(pair.ids[0])]);
    add_row(pair, met.then, row);
    for (std::size_t k = 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k)
      dirty_[slot(row.ids[k])] = 1;
  }
}

// Applies impulses until no pair hits; false if some still do after the last round.
bool SurfaceContact::advance_rows(Particles& particles, double t_end) {
  std::ranges::fill(dirty_, std::uint8_t{0});
  impulses_.relax(kSweeps[0], inverse_mass_, displacement_, touched_, dirty_);
  for (int round = 0; round < kImpulseRounds; ++round) {
    if (particles.pool().gives_up(0)) return false;
    meet_colliders(particles, t_end, dirty_);
    impulses_.relax(kSweeps[1], inverse_mass_, displacement_, touched_, dirty_);
    find_hits(particles.pool(), round == 0);
    const bool inside = meet_colliders(particles, t_end, touched_), strained = limit_strain();
    if (hits_.empty() && !inside && !strained) return true;
    std::ranges::fill(dirty_, std::uint8_t{0});
    add_hits();
    impulses_.relax(kSweeps[1], inverse_mass_, displacement_, touched_, dirty_);
  }
  return false;
}

bool SurfaceContact::advance_zones(Particles& particles) {
  impact_zones_.begin(displacement_);
  std::ranges::fill(dirty_, std::uint8_t{1});
  for (;;) {
    if (particles.pool().gives_up(0)) return false;
    find_hits(particles.pool(), false);
    if (hits_.empty()) return true;
    for (const ProximityHit& met : hits_) impact_zones_.join(pairs_.pairs()[met.pair].ids, met.s);
    if (!impact_zones_.apply(inverse_mass_, from_, displacement_)) {
      refusal_ = "particle " + std::to_string(impact_zones_.culprit()) +
                 " is moved by its prescribed path through a surface that has no room left";
      return false;
    }
    std::ranges::fill(dirty_, std::uint8_t{0});
    for (const int i : impact_zones_.members()) touched_[slot(i)] = dirty_[slot(i)] = 1;
  }
}

// The least velocity along a row, m/s: 0 for a pair at its least distance or a particle at a
// collider, none outwards for an edge at its greatest length.
double SurfaceContact::least_rate(const Particles& particles, double t_end,
                                  const ContactRow& row) const {
  if (row.ids[1] < 0) {
    double most = -HUGE_VAL;
    const Vec3 x = from_[slot(row.ids[0])] + displacement_[slot(row.ids[0])];
    for (Collider* const collider : particles.contacts().all()) {
      const SurfaceSample sample = collider->query(t_end, x);
      if (sample.gap <= 2 * kContactInside * spec_.thickness)
        most = std::max(most, row.normal.dot(sample.velocity));
    }
    return most;
  }
  double beyond = -row.bound;  // m, of where it is as far apart as its gap
  for (std::size_t k = 0; k < ContactRow::kMost && row.ids[k] >= 0; ++k)
    beyond += row.weights[k] * row.normal.dot(displacement_[slot(row.ids[k])]);
  const bool edge = row.ids[2] < 0;
  const bool held = edge ? beyond <= 2 * kSlack * row.gap
                         : row.gap + beyond <= spec_.thickness * (1 + 2 * kSlack);
  return held ? 0.0 : -HUGE_VAL;
}

// Solves the velocities: no contact approaches further, with friction.
void SurfaceContact::find_velocities(Particles& particles, double t_end, double h) {
  bounds_.clear();
  for (const ContactRow& row : impulses_.rows())
    bounds_.push_back(least_rate(particles, t_end, row));
  if (bodies_) {
    bodies_->points({from_, displacement_, dirty_});
    bodies_->find_motions(inverse_mass_);
    for (const auto& [r, pair, apart] : of_bodies_) {
      ContactRow row = impulses_.rows()[r];
      bodies_->extend(pair, apart, 1, row);
      impulses_.replace(r, row);
    }
  }
  impulses_.begin(bounds_, 1e-6 * spec_.thickness / h, inverse_mass_);
  if (islands_) return find_constrained_velocities();
  impulses_.relax(2 * kSweeps[0], inverse_mass_, velocity_, touched_, dirty_);
  if (impact_zones_.empty()) return;
  for (const int i : movable_) ends_[slot(i)] = from_[slot(i)] + displacement_[slot(i)];
  impact_zones_.slow(inverse_mass_, ends_, velocity_);
}

void SurfaceContact::write(Particles& particles, double* x_next) const {
  const auto q = particles.layout().axes(x_next), v = particles.layout().axes(x_next, 3);
  for (const int i : movable_) {
    if (!changed(i) || inverse_mass_[slot(i)] == 0) continue;
    const Vec3 place = from_[slot(i)] + displacement_[slot(i)];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (displacement_[slot(i)] != free_displacement_[slot(i)]) q[axis][i] = place[axis];
      v[axis][i] = velocity_[slot(i)][axis];
    }
  }
}

// Takes this much energy from the velocities of all particles in contact relative to their mean;
// false, with all of it taken, if they have less.
bool SurfaceContact::brake(double excess) {
  Vec3 moment = Vec3::Zero();
  double mass = 0, inner = 0;
  const bool mean_stays = !islands_ || islands_->spread(touched_);
  const auto each = [&](const auto& visit) {
    for (const int i : movable_)
      if (changed(i) && inverse_mass_[slot(i)] > 0) visit(slot(i), 1 / inverse_mass_[slot(i)]);
  };
  each([&](std::size_t i, double m) { mass += m, moment += m * velocity_[i]; });
  if (mass == 0) return true;
  const Vec3 mean = mean_stays ? moment / mass : Vec3::Zero();
  each([&](std::size_t i, double m) { inner += 0.5 * m * (velocity_[i] - mean).squaredNorm(); });
  const double share = inner > excess ? std::sqrt(1 - excess / inner) : 0.0;
  each([&](std::size_t i, double) { velocity_[i] = mean + share * (velocity_[i] - mean); });
  return share > 0;
}

// If springs that contact holds back have more energy than contact took, velocities pay for the
// rest. If they cannot, all surfaces move less relative to their mean, by a smaller share of
// displacements that are known to be free, down to none.
void SurfaceContact::store(Particles& particles, double t, double h, const double* x,
                           double* x_next) {
  const auto total = [&](double when, const double* state) {
    return particles.kinetic_energy(when, state) + particles.potential_energy(when, state);
  };
  const double before = total(t, x), free = total(t + h, x_next);
  const double most = std::max(before, free);
  const bool kinematic = std::ranges::any_of(movable_, [&](int i) {
    return inverse_mass_[slot(i)] == 0 && displacement_[slot(i)] != Vec3::Zero();
  });
  write(particles, x_next);
  double after = total(t + h, x_next);
  for (int halving = 0; after > most && halving < kHalvingsOfAll; ++halving) {
    const bool paid = brake(after - most);
    if (!paid && islands_) {
      if (kinematic || !give_way(particles)) break;
    } else if (!paid) {
      Vec3 moment = Vec3::Zero();
      double mass = 0;
      bool held = false;
      for (const int i : movable_) {
        touched_[slot(i)] = 1;
        held = held || inverse_mass_[slot(i)] == 0;
        if (inverse_mass_[slot(i)] == 0) continue;
        mass += 1 / inverse_mass_[slot(i)];
        moment += displacement_[slot(i)] / inverse_mass_[slot(i)];
      }
      if (kinematic) break;  // hands give it
      const Vec3 mean = held ? Vec3::Zero() : moment / mass;
      const double share = halving + 2 < kHalvingsOfAll ? 0.5 : 0.0;
      for (const int i : movable_)
        displacement_[slot(i)] = mean + share * (displacement_[slot(i)] - mean);
    }
    if (islands_) islands_->project_velocities(from_, displacement_, velocity_, touched_);
    write(particles, x_next);
    after = total(t + h, x_next);
    if (paid) break;
  }
  work_ += free - after;
  kinematic_ = kinematic;
  if (!collides_) return;
  for (const int i : movable_)
    if (changed(i) && inverse_mass_[slot(i)] > 0)
      for (Collider* const collider : particles.contacts().all())
        counts_.deepest = std::max(
            counts_.deepest, -collider->query(t + h, from_[slot(i)] + displacement_[slot(i)]).gap);
}

// Advances from from_ along the displacements.
bool SurfaceContact::advance(Particles& particles, double t_end) {
  pairs_.find_near(points(), particles.pool());
  impulses_.clear(from_.size());
  of_bodies_.clear();
  if (bodies_) bodies_->find_motions(inverse_mass_);
  impact_zones_.begin({});
  make_rows();
  limit_strain();
  return islands_ ? advance_constrained(particles, t_end) || advance_shortened(particles)
                  : advance_rows(particles, t_end) || advance_zones(particles);
}

SurfaceContact::Outcome SurfaceContact::resolve(Particles& particles, double t, double h,
                                                const double* x, double* x_next) {
  // A sheet that stays unfolded all the step has no self-contact: neighbours in a layer do not
  // count.
  const Layout& layout = particles.layout();
  if (sheet_ && !bodies_ && longest_.empty() &&
      sheet_->stays_open(layout.axes(x), layout.axes(static_cast<const double*>(x_next)),
                         kOpen * spec_.thickness))
    return Outcome::kFree;
  load(particles, x, x_next);
  for (const int i : pairs_.parts().particles()) {
    if (!displacement_[slot(i)].allFinite()) return Outcome::kFree;  // the run ends by itself
    const Vec3 reached = from_[slot(i)].cwiseAbs() + displacement_[slot(i)].cwiseAbs();
    if (reached.maxCoeff() < kFarthest) continue;
    refusal_ = "particle " + std::to_string(i) + " of a surface has gone farther than " +
               brief(kFarthest) + " m, where contact cannot be found";
    return Outcome::kRefused;
  }
  collides_ = !particles.contacts().empty();
  dirty_.assign(from_.size(), 0);
  pairs_.begin(points(), particles.pool());
  if (pairs_.pairs().empty() && longest_.empty()) return Outcome::kFree;

  touched_.assign(from_.size(), 0);
  free_displacement_ = displacement_;
  span_ = h;
  first_ = from_;
  ends_.resize(from_.size());
  if (islands_) islands_->begin(t, h, x, x_next);
  if (!advance(particles, t + h) && (islands_ || !advance_substeps(particles, t, h)))
    return Outcome::kRefused;

  velocity_.resize(from_.size());
  const auto v = particles.layout().axes(x_next, 3);
  for (const int i : movable_) velocity_[slot(i)] = {v[0][i], v[1][i], v[2][i]};
  find_velocities(particles, t + h, h);
  join_substeps();
  if (std::ranges::count(touched_, 1) == 0) return Outcome::kFree;
  store(particles, t, h, x, x_next);
  if (islands_) islands_->follow(x_next);
  ++counts_.steps;
  counts_.pairs = std::max(counts_.pairs, static_cast<std::int64_t>(impulses_.rows().size()));
  counts_.zones =
      std::max(counts_.zones, static_cast<std::int64_t>(impact_zones_.members().size()));
  return Outcome::kChanged;
}

}  // namespace sim
