#include "core/particles/constraints/unilateral_rattle.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/axes.h"

namespace sim {
namespace {

// Moments at which hits cut a step, if it is not that they must: each costs as much as the step, so
// that many particles share few.
constexpr int kLeastMoments = 3, kMostMoments = 60, kParticlesCut = 3000;
constexpr double kSlipTolerance = 1e-9;  // of the velocities at hand: a slip that is none
constexpr int kAtOnce = 128;
constexpr std::size_t kFew = 1000;  // that touch more than one collider; more make room

}  // namespace

UnilateralRattle::UnilateralRattle(Particles& particles, ConstraintSystem& constraint_system,
                                   bool first_order)
    : particles_(&particles),
      constraint_system_(&constraint_system),
      first_order_(first_order),
      most_moments_(std::clamp(kParticlesCut / std::max(1, particles.layout().n()), kLeastMoments,
                               kMostMoments)),
      start_rows_(constraint_system.constraints().rows()),
      rows_(constraint_system.constraints().rows()),
      solver_(constraint_system.constraints()),
      free_(constraint_system.internal_begin() + constraint_system.internal_size()) {
  const auto n = static_cast<std::size_t>(particles.layout().n());
  candidates_.reserve(n);
  for (std::vector<ContactForce>* contacts : {&contacts_, &velocity_contacts_})
    contacts->reserve(n + kFew);
  impacts_.reserve(n + kFew);
}

void UnilateralRattle::find_candidates(const SubstepStates& ends) {
  candidates_.clear();
  const double t = ends.t, r = ends.r;
  const ParticleView begin = particles_->view(t, ends.from), end = particles_->view(t + r, ends.to);
  const Contacts& contacts = particles_->contacts();
  const auto path_of = [&](int i) {
    return StepPath::between(r, begin.position(i), begin.velocity(i), end.position(i),
                             end.velocity(i))
        .length();
  };
  for (int first = 0; first < constraint_system_->contact_count(); first += kAtOnce) {
    const int last = std::min(first + kAtOnce, constraint_system_->contact_count());
    Vec3 low = end.position(first), high = low;
    double longest = 0;
    for (int i = first; i < last; ++i) {
      low = low.cwiseMin(end.position(i));
      high = high.cwiseMax(end.position(i));
      longest = std::max(longest, path_of(i));
    }
    const Vec3 middle = 0.5 * (low + high), half = 0.5 * (high - low);
    const double margin =
        kContactTolerance * position_scale(low.cwiseAbs().cwiseMax(high.cwiseAbs()));
    if (!contacts.near(t, r, middle, half, longest + margin)) continue;
    for (int i = first; i < last; ++i)
      if (end.free(i) && contacts.near(t, r, end.position(i), Vec3::Zero(), path_of(i) + margin))
        candidates_.push_back(i);
  }
}

bool UnilateralRattle::find_impact(const SubstepStates& ends, int i, Collider& collider,
                                   Impact& impact) const {
  const ParticleView begin = particles_->view(ends.t, ends.from),
                     end = particles_->view(ends.t + ends.r, ends.to);
  const Vec3 x0 = begin.position(i), v0 = begin.velocity(i), v1 = end.velocity(i);
  const SurfaceSample start = collider.query(ends.t, x0);
  const double rate0 = start.normal.dot(v0 - start.velocity);
  const double still = kSlipTolerance * (v0.norm() + start.velocity.norm()) + 1e-14;
  const bool touches = start.gap <= kContactTolerance * position_scale(x0);
  const StepPath path = StepPath::between(ends.r, x0, v0, end.position(i), v1);
  impact = {};
  impact.particle = i, impact.collider = &collider;
  // A particle that leaves may return within the substep; if it does so soon, it rests.
  if (!touches || (rate0 > still && !first_order_))
    impact.s = Contacts::first_touch(collider, ends.t, ends.r, path);
  if (touches && !(impact.s >= kShortestFlight && impact.s <= 1)) {
    impact.s = 0;
    impact.known = rate0 >= -still;
  }
  if (!(impact.s <= 1)) return false;
  const SurfaceSample touched =
      impact.s > 0 ? collider.query(ends.t + impact.s * ends.r, path.at(impact.s)) : start;
  const Vec3 velocity = impact.s > 0 ? Vec3(path.rate(impact.s) / ends.r) : v0;
  impact.normal = touched.normal;
  impact.closing = std::max(0.0, -touched.normal.dot(velocity - touched.velocity));
  if (impact.known) return true;
  impact.gained = std::fabs(touched.normal.dot(v1 - touched.velocity) - rate0);
  const SurfaceSample end_touch = collider.query(ends.t + ends.r, end.position(i));
  impact.gap = end_touch.gap;
  impact.through = end_touch.gap > 0 || end_touch.normal.dot(impact.normal) < 0.5;
  // Where the substep ends at it, it bounces unless the flight is a small share of the substep.
  // Where the substep goes on, it leaves the surface only if the flight lasts to the end.
  const double e = collider.material().restitution_at(impact.closing),
               flight = 2 * e * impact.closing;
  impact.leaves = e > 0 && flight > (1 - impact.s) * impact.gained;
  impact.bounces = impact.leaves || (!first_order_ && flight > kShortestFlight * impact.gained);
  impact.cuts = impact.through || impact.bounces || (e == 0 && impact.closing > impact.gained);
  return true;
}

void UnilateralRattle::find_impacts(const SubstepStates& ends) {
  impacts_.clear();
  find_candidates(ends);
  for (const int i : candidates_)
    for (Collider* const collider : particles_->contacts().all())
      if (Impact impact; find_impact(ends, i, *collider, impact)) impacts_.push_back(impact);
}

// The first impact at which to cut the substep; those that must be cut alone, if there are too
// many.
double UnilateralRattle::next_cut() const {
  double first = kNoImpact, must = kNoImpact;
  double moments[kMostMoments + 1];
  int count = 0;
  for (const Impact& impact : impacts_) {
    if (impact.known || !impact.cuts) continue;
    first = std::min(first, impact.s);
    if (impact.through) must = std::min(must, impact.s);
    bool other = count <= most_moments_;
    for (int k = 0; k < count && other; ++k)
      other = std::fabs(moments[k] - impact.s) > kSimultaneous;
    if (other) moments[count++] = impact.s;
  }
  return count <= most_moments_ ? first : must;
}

double UnilateralRattle::energy(double t, const double* state) const {
  return particles_->kinetic_energy(t, state) + particles_->potential_energy(t, state);
}

// Books the work of the last solve with the particles in contact.
void UnilateralRattle::record_work() {
  ContactWorkSums& work_sums = particles_->contacts().work_sums();
  ContactWork work = work_;
  for (const auto* contacts : {&contacts_, &velocity_contacts_})
    for (const ContactForce& contact : *contacts)
      if (contact.active) work_sums.enter(contact.particle, 1, std::exchange(work, {}));
  if (work.lost != 0 && !contacts_.empty()) work_sums.enter(contacts_.front().particle, 1, work);
}

bool UnilateralRattle::push_out(double t, const double* x, double* to) {
  const Substep substep{t, 0, x, to, true};
  contacts_.clear();
  impacts_.clear();
  for (double* each : {to, free_.data()}) std::copy_n(x, free_.size(), each);
  if (!add_penetrating(substep)) return false;
  const double before = energy(t, x);
  const bool known =
      start_rows_.evaluate(particles_->view(t, x), x + constraint_system_->internal_begin());
  work_ = {};
  if (!known || !(project_contacts(substep, false) || project_contacts(substep, true)) ||
      !solve_end_velocities(substep)) {
    std::copy_n(x, free_.size(), to);  // the step will say so
    return true;
  }
  work_.lost = before - energy(t, to) + work_.given;
  record_work();
  return true;
}

bool UnilateralRattle::correct_drift(const Substep& substep,
                                     std::span<const ContactForce> resting) {
  const double end = substep.t + substep.r;
  std::copy_n(substep.to, free_.size(), free_.data());
  until_ = -1;
  contacts_.assign(resting.begin(), resting.end());
  if (!add_penetrating(substep) && resting.empty()) return true;
  bool pulls = true;
  for (ContactForce& contact : contacts_) contact.bilateral = contact.active;
  if (!project_contacts(substep, true)) {
    // Bilateral contact forces may contradict rods by the error of the method.
    pulls = false;
    for (ContactForce& contact : contacts_) contact.bilateral = false;
    if (!project_contacts(substep, true)) return refuse(" m");
  }
  double* const memory = substep.to + constraint_system_->internal_begin();
  constraint_system_->constraints().follow(particles_->view(end, substep.to), memory);
  if (!rows_.evaluate(particles_->view(end, substep.to), memory)) return false;
  // Penetrating particles without a resting contact keep their velocities: they are impacts.
  velocity_contacts_.assign(resting.begin(), resting.end());
  const auto q = particles_->layout().axes(substep.to);
  for (ContactForce& contact : velocity_contacts_) {
    const SurfaceSample sample = contact.collider->query(end, vector_at(q, contact.particle));
    contact.normal = sample.normal, contact.surface_velocity = sample.velocity;
    contact.bilateral = pulls && contact.active;
  }
  return solve_velocities(substep, 1e-12) || refuse(" m/s");
}

bool UnilateralRattle::find_hits(double t, const double* x, double still, double slow) {
  impacts_.clear();
  find_candidates({t, 0, x, x});
  const ParticleView now = particles_->view(t, x);
  bool hits = false;
  for (const int i : candidates_) {
    const Vec3 place = now.position(i), v = now.velocity(i);
    for (Collider* const collider : particles_->contacts().all()) {
      const SurfaceSample sample = collider->query(t, place);
      if (sample.gap > kContactTolerance * position_scale(place)) continue;
      Impact impact;
      impact.particle = i, impact.collider = collider, impact.normal = sample.normal;
      impact.closing = std::max(0.0, sample.normal.dot(sample.velocity - v));
      impact.known = !(impact.closing > slow + still * (v.norm() + sample.velocity.norm()));
      impact.bounces = !impact.known && collider->material().restitution > 0;
      hits = hits || !impact.known;
      impacts_.push_back(impact);
    }
  }
  return hits;
}

}  // namespace sim
