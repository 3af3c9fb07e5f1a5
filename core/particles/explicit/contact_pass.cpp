#include "core/particles/explicit/contact_pass.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/geometry/bounding_box.h"
#include "core/math/axes.h"
#include "core/particles/explicit/resting_contact_kernel.h"
#include "core/particles/late_velocities.h"

namespace sim {
namespace {

constexpr int kWaysAtOnce = 128;
constexpr std::uint8_t kSingly = 1, kAlone = 2;
constexpr std::size_t kMostAlone = 0xff - kAlone;
constexpr unsigned kAll = 0xff;

RestingContactStep step_of(double h, const ParticleContactPass::In& q0,
                           const ParticleContactPass::In& v0, const ParticleContactPass::Out& q,
                           const ParticleContactPass::Out& v) {
  RestingContactStep step;
  step.h = h;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    step.q0[axis] = q0[axis];
    step.v0[axis] = v0[axis];
    step.q[axis] = q[axis];
    step.v[axis] = v[axis];
  }
  return step;
}

}  // namespace

// The surfaces that paths in a bounding box may touch, and the gaps within which they may.
struct ParticleContactPass::NearbyColliders {
  static constexpr int kMost = 8;
  PrimitiveSurface surfaces[kMost];
  double reach[kMost];  // m
  int count = 0;
  bool any = false, all = true;  // all: these are all that there are

  bool to(const Vec3& x) const {
    for (int k = 0; k < count; ++k)
      if (!(surfaces[k].gap(x) > reach[k])) return true;
    return !all;
  }
};

struct ParticleContactPass::Kernels {
  BoundingBoxOf bounding_box_of = sim::bounding_box_of();
  RestingContactKernels resting = resting_contact_kernels();
};

struct ParticleContactPass::Free {
  double q[3][kWaysAtOnce], v[3][kWaysAtOnce];
};

ParticleContactPass::ParticleContactPass(Particles& particles, bool first_order)
    : particles_(&particles),
      first_order_(first_order),
      kernels_(std::make_shared<const Kernels>()),
      resting_by_(static_cast<std::size_t>(particles.layout().n() / kLanes + 1) * kLanes) {}

void ParticleContactPass::begin(double t, double t1) {
  particles_->contacts().work_sums().begin_step();
  if (particles_->contacts().sampled()) particles_->contacts().prepare_interval(t, t1);
}

// Bounds the length of every path of the block: |p'| lies within the convex hull of its Bezier
// points.
ParticleContactPass::BlockExtent ParticleContactPass::extent_of_block(
    const RestingContactStep& step, int begin, int end) const {
  const BoundingBox extent = kernels_->bounding_box_of(step.q, step.v0, step.v,
                                                       step.whole ? step.q0 : nullptr, begin, end);
  BlockExtent room;
  room.longest = step.h * (std::sqrt(extent.fastest[0]) +
                           (step.whole ? 1 : 2) * std::sqrt(extent.fastest[1])) +
                 3 * std::sqrt(extent.farthest);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    room.middle[axis] = 0.5 * extent.least[axis] + 0.5 * extent.most[axis];
    room.half[axis] = 0.5 * extent.most[axis] - 0.5 * extent.least[axis];
  }
  return room;
}

// The index of the only collider that the block may touch, if it is a plane or sphere; otherwise
// -1.
int ParticleContactPass::alone(double t, const BlockExtent& room, RestingContactStep& step) const {
  const Contacts& contacts = particles_->contacts();
  if (contacts.accuracy() != Accuracy::kSettle) return -1;
  const std::span<Collider* const> all = contacts.all();
  const double t1 = t + step.h;
  int only = -1;
  step.room = HUGE_VAL;
  for (std::size_t n = 0; n < all.size(); ++n) {
    const double fastest = all[n]->max_speed(t, t1);
    const double free =
        all[n]->clearance(t1, room.middle, room.half) - room.longest - step.h * fastest;
    if (free > 1e3 * Contacts::slack(room.middle))
      step.room = std::min(step.room, free);
    else if (only < 0 && n <= kMostAlone)
      only = static_cast<int>(n);
    else
      return -1;
  }
  if (only < 0) return -1;
  const Collider& collider = *all[static_cast<std::size_t>(only)];
  step.before = collider.as_primitive(t);
  step.after = collider.as_primitive(t1);
  if (step.before.form != step.after.form || step.after.form == PrimitiveSurface::Form::kNone)
    return -1;
  const ContactMaterial surface = collider.material();
  if (surface.law) return -1;  // the kernels are those of Coulomb's
  step.friction = surface.friction;
  step.restitution = surface.restitution;
  step.reach = step.h * collider.max_speed(t, t1);
  step.moves = collider.moves();
  return only;
}

// Most paths in a bounding box near a surface do not come near it.
ParticleContactPass::NearbyColliders ParticleContactPass::colliders_near(
    double t, double h, const BlockExtent& room) const {
  NearbyColliders close;
  for (Collider* const collider : particles_->contacts().all()) {
    const double reach = room.longest + h * collider->max_speed(t, t + h);
    if (collider->clearance(t + h, room.middle, room.half) > reach) continue;
    close.any = true;
    const PrimitiveSurface plain = collider->as_primitive(t + h);
    if (plain.form == PrimitiveSurface::Form::kNone || close.count == NearbyColliders::kMost) {
      close.all = false;
      return close;
    }
    close.surfaces[close.count] = plain;
    close.reach[close.count++] = reach;
  }
  return close;
}

// The broad phase rejects most blocks of particles at once; resting contacts on a single plane or
// sphere are resolved eight at a time.
void ParticleContactPass::resolve(double t, RestingContactStep& step, int begin, int end) {
  const Contacts& contacts = particles_->contacts();
  if (contacts.accuracy() == Accuracy::kEvent) return;  // steps end where it touches
  const bool lay = any_resting(begin, end);  // some of them in the step before: they are near
  std::fill(resting_by_.begin() + begin, resting_by_.begin() + end, std::uint8_t{0});
  const auto near = [&](const BlockExtent& room) {
    return contacts.near(t, step.h, room.middle, room.half, room.longest);
  };
  if (!lay && end - begin > kWaysAtOnce && !near(extent_of_block(step, begin, end))) return;
  step.free = particles_->motion().free;
  step.once = first_order_;
  for (int first = begin; first < end; first += kWaysAtOnce) {
    const int last = std::min(first + kWaysAtOnce, end);
    const BlockExtent room = extent_of_block(step, first, last);
    const NearbyColliders close = colliders_near(t, step.h, room);
    if (!close.any) continue;
    Free free;
    const bool late = first_order_ && step.whole;
    for (int axis = 0; axis < 3 && late; ++axis) {
      std::copy(step.q[axis] + first, step.q[axis] + last, free.q[axis]);
      std::copy(step.v[axis] + first, step.v[axis] + last, free.v[axis]);
    }
    RestingContactBlock block[kWaysAtOnce / kLanes] = {};
    const int only = alone(t, room, step);
    if (only >= 0) kernels_->resting.resolve(step, first, last, block);
    for (int i = first; i < last; i += kLanes) {
      const RestingContactBlock& these = block[(i - first) / kLanes];
      const auto presses = static_cast<std::uint8_t>(kAlone + only);
      for (unsigned bits = these.resting; bits != 0; bits &= bits - 1)
        resting_by_[static_cast<std::size_t>(i + std::countr_zero(bits))] = presses;
      if (these.known == kAll) {
        enter(step, i, these.met, these);
        continue;
      }
      for (int lane = 0; lane < kLanes && i + lane < last; ++lane)
        if (const unsigned bit = 1u << lane; these.known & bit)
          enter(step, i, these.met & bit, these);
        else if (close.to(vector_at(step.q, i + lane)))
          resolve_one(t, step, i + lane);
    }
    if (late) record_late_work(step, free, first, last);
  }
}

void ParticleContactPass::record_late_work(const RestingContactStep& step, const Free& free,
                                           int begin, int end) {
  for (int i = begin; i < end; ++i) {
    const int k = i - begin;
    const Vec3 v(free.v[0][k], free.v[1][k], free.v[2][k]), now = vector_at(step.v, i);
    if (v == now) continue;
    const Vec3 x(free.q[0][k], free.q[1][k], free.q[2][k]);
    const double work = late_work(step.h, vector_at(step.q0, i), vector_at(step.v0, i), x, v, now);
    particles_->contacts().work_sums().enter(i, particles_->masses()[static_cast<std::size_t>(i)],
                                             {work, 0});
  }
}

void ParticleContactPass::resolve_one(double t, const RestingContactStep& step, int i) {
  const double mass = particles_->masses()[static_cast<std::size_t>(i)];
  if (!(mass < HUGE_VAL)) return;
  const double h = step.h;
  const Vec3 x0 = vector_at(step.q0, i), v0 = vector_at(step.v0, i), x1 = vector_at(step.q, i);
  Vec3 place = x1, velocity = vector_at(step.v, i);
  StepPath path = step.whole ? StepPath::between(h, x0, v0, x1, velocity)
                             : StepPath{{x0, h * v0, x1 - x0 - h * v0, Vec3::Zero()}};
  path.once = step.once;
  const Contacts& contacts = particles_->contacts();
  if (!contacts.near(t, h, place, Vec3::Zero(), path.length())) return;
  if (!contacts.resolve(t, h, i, mass, step.whole, path, place, velocity)) return;
  resting_by_[static_cast<std::size_t>(i)] = path.resting ? kSingly : 0;
  put_vector(step.q, i, place);
  put_vector(step.v, i, velocity);
}

// Books the contacts of those of eight particles whose bits are set, in their order.
void ParticleContactPass::enter(const RestingContactStep& step, int i, unsigned bits,
                                const RestingContactBlock& block) {
  if (bits == 0) return;
  ContactWorkSums& work_sums = particles_->contacts().work_sums();
  ContactWork sum = work_sums.sum_of(i);
  double known = 0, scaled = 0;
  for (; bits != 0; bits &= bits - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
    const double mass = particles_->masses()[static_cast<std::size_t>(i) + lane];
    if (mass != known) scaled = mass / (step.h * step.h), known = mass;
    sum.lost += scaled * block.lost[lane];
    sum.given += scaled * block.given[lane];
    if (step.whole && block.resting >> lane & 1) {
      sum.lost += mass * block.lost_velocity[lane];
      sum.given += mass * block.given_velocity[lane];
    }
    work_sums.mark(i + static_cast<int>(lane));
  }
  work_sums.sum_of(i) = sum;
}

void ParticleContactPass::end(double t, double h, const In& q0, const In& v0, const Out& q,
                              const Out& v, int begin, int end) {
  RestingContactStep step = step_of(h, q0, v0, q, v);
  step.whole = true;
  resolve(t, step, begin, end);
}

void ParticleContactPass::resolve_after_drift(double t, double h, const In& q0, const In& v0,
                                              const Out& q, const Out& v, int begin, int end) {
  RestingContactStep step = step_of(h, q0, v0, q, v);
  resolve(t, step, begin, end);
}

void ParticleContactPass::constrain_after_kick(double t, RestingContactKick kick, int begin,
                                               int end) {
  if (!any_resting(begin, end)) return;
  const Contacts& contacts = particles_->contacts();
  int known = 0;  // the collider that `kick` is of
  for (int i = begin; i < end; i += kLanes) {
    if (resting_mask(i) == 0) continue;
    const std::uint8_t* const resting = resting_by_.data() + i;
    unsigned bits = 0, by = 0;
    bool alone = true;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (resting[lane] == 0) continue;
      alone = alone && resting[lane] >= kAlone && (by == 0 || by == resting[lane]);
      by = resting[lane];
      bits |= 1u << lane;
    }
    RestingContactBlock block;
    if (alone && static_cast<int>(by) != known) {
      const Collider& collider = *contacts.all()[by - kAlone];
      kick.surface = collider.as_primitive(t);
      kick.friction = collider.material().friction;
      known = static_cast<int>(by);
    }
    alone = alone && kernels_->resting.constrain_velocity(kick, i, bits, block);
    for (; bits != 0; bits &= bits - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
      const int id = i + static_cast<int>(lane);
      if (alone)
        contacts.work_sums().enter(id, particles_->masses()[static_cast<std::size_t>(id)],
                                   {block.lost_velocity[lane], block.given_velocity[lane]});
      else
        constrain_one(t, kick, id);
    }
  }
}

void ParticleContactPass::constrain_one(double t, const RestingContactKick& kick, int i) {
  const Vec3 held = particles_->contacts().constrain_velocity(
      t, i, particles_->masses()[static_cast<std::size_t>(i)], vector_at(kick.q, i),
      vector_at(kick.v, i));
  put_vector(kick.v, i, held);
  if (!kick.a[0]) return;
  const double keep = kick.next.keeps ? kick.next.keeps[i] : kick.next.keep;
  const double gain = kick.next.keeps ? kick.next.gains[i] : kick.next.gain;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    kick.v_after[axis][i] = std::fma(gain, kick.a[axis][i], keep * held[axis]);
    if (kick.q_next[0])
      kick.q_next[axis][i] = std::fma(kick.drift, kick.v_after[axis][i], kick.q[axis][i]);
  }
}

bool ContactStepper::step(double t, double h, int count, const double* x, double* x_next) {
  if (!stepper_->step(t, h, count, x, x_next)) return false;
  contact_pass_.begin(t, t + h);
  const Layout& layout = particles_->layout();
  particles_->pool().run_parts(layout.n(), 16, [&](int begin, int end) {
    contact_pass_.end(t, h, layout.axes(x), layout.axes(x, 3), layout.axes(x_next),
                      layout.axes(x_next, 3), begin, end);
  });
  return contact_pass_.succeeded();
}

}  // namespace sim
