#include "core/particles/explicit/settling.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/particles/axes.h"
#include "core/particles/late_velocities.h"

namespace sim {
namespace {

constexpr int kWaysAtOnce = 128;
constexpr std::uint8_t kSingly = 1, kAlone = 2;
constexpr std::size_t kMostAlone = 0xff - kAlone;
constexpr unsigned kAll = 0xff;

LyingStep step_of(double h, const Settling::In& q0, const Settling::In& v0, const Settling::Out& q,
                  const Settling::Out& v) {
  LyingStep step;
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

// The surfaces that ways in a room may touch, and the gaps at which they may.
struct Settling::Close {
  static constexpr int kMost = 8;
  PlainSurface surfaces[kMost];
  double reach[kMost];  // m
  int count = 0;
  bool any = false, all = true;  // all: these are all that there are

  bool to(const Vec3& x) const {
    for (int k = 0; k < count; ++k)
      if (!(surfaces[k].gap(x) > reach[k])) return true;
    return !all;
  }
};

struct Settling::Free {
  double q[3][kWaysAtOnce], v[3][kWaysAtOnce];
};

Settling::Settling(Particles& particles, bool first_order)
    : particles_(&particles),
      first_order_(first_order),
      pressed_(static_cast<std::size_t>(particles.layout().n() / kLanes + 1) * kLanes) {}

void Settling::begin(double t, double t1) {
  particles_->contacts().ledger().begin_step();
  if (particles_->contacts().sampled()) particles_->contacts().look(t, t1);
}

// No way is longer than that of the largest numbers of all of them: |p'| is within the hull of its
// Bezier points.
Settling::Room Settling::room_of(const LyingStep& step, int begin, int end) const {
  const Extent extent =
      extent_of_(step.q, step.v0, step.v, step.whole ? step.q0 : nullptr, begin, end);
  Room room;
  room.longest = step.h * (std::sqrt(extent.fastest[0]) +
                           (step.whole ? 1 : 2) * std::sqrt(extent.fastest[1])) +
                 3 * std::sqrt(extent.farthest);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    room.middle[axis] = 0.5 * extent.least[axis] + 0.5 * extent.most[axis];
    room.half[axis] = 0.5 * extent.most[axis] - 0.5 * extent.least[axis];
  }
  return room;
}

// Where all that they may touch is one plane or sphere: the number of that collider; or -1.
int Settling::alone(double t, const Room& room, LyingStep& step) const {
  const Contacts& contacts = particles_->contacts();
  if (contacts.accuracy() != Accuracy::kSettle) return -1;
  const std::span<Collider* const> all = contacts.all();
  const double t1 = t + step.h;
  int only = -1;
  step.room = HUGE_VAL;
  for (std::size_t n = 0; n < all.size(); ++n) {
    const double fastest = all[n]->fastest(t, t1);
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
  step.before = collider.plain(t);
  step.after = collider.plain(t1);
  if (step.before.form != step.after.form || step.after.form == PlainSurface::Form::kNone)
    return -1;
  const Surface surface = collider.surface();
  if (surface.law) return -1;  // the kernels are those of Coulomb's
  step.friction = surface.friction;
  step.restitution = surface.restitution;
  step.reach = step.h * collider.fastest(t, t1);
  step.moves = collider.moves();
  return only;
}

// Most ways in a room that is near a surface do not come near it.
Settling::Close Settling::close_to(double t, double h, const Room& room) const {
  Close close;
  for (Collider* const collider : particles_->contacts().all()) {
    const double reach = room.longest + h * collider->fastest(t, t + h);
    if (collider->clearance(t + h, room.middle, room.half) > reach) continue;
    close.any = true;
    const PlainSurface plain = collider->plain(t + h);
    if (plain.form == PlainSurface::Form::kNone || close.count == Close::kMost) {
      close.all = false;
      return close;
    }
    close.surfaces[close.count] = plain;
    close.reach[close.count++] = reach;
  }
  return close;
}

// Mostly nothing is near, which is seen of many particles at once; what lies on one surface is
// settled many at a time, too.
void Settling::settle(double t, LyingStep& step, int begin, int end) {
  const Contacts& contacts = particles_->contacts();
  if (contacts.accuracy() == Accuracy::kEvent) return;  // steps end where it touches
  const bool lay = will_hold(begin, end);  // some of them in the step before: they are near
  std::fill(pressed_.begin() + begin, pressed_.begin() + end, std::uint8_t{0});
  const auto near = [&](const Room& room) {
    return contacts.near(t, step.h, room.middle, room.half, room.longest);
  };
  if (!lay && end - begin > kWaysAtOnce && !near(room_of(step, begin, end))) return;
  step.free = particles_->motion().free;
  for (int first = begin; first < end; first += kWaysAtOnce) {
    const int last = std::min(first + kWaysAtOnce, end);
    const Room room = room_of(step, first, last);
    const Close close = close_to(t, step.h, room);
    if (!close.any) continue;
    Free free;
    const bool late = first_order_ && step.whole;
    for (int axis = 0; axis < 3 && late; ++axis) {
      std::copy(step.q[axis] + first, step.q[axis] + last, free.q[axis]);
      std::copy(step.v[axis] + first, step.v[axis] + last, free.v[axis]);
    }
    Lying lying[kWaysAtOnce / kLanes] = {};
    const int only = alone(t, room, step);
    if (only >= 0) lying_.settle(step, first, last, lying);
    for (int i = first; i < last; i += kLanes) {
      const Lying& these = lying[(i - first) / kLanes];
      const auto presses = static_cast<std::uint8_t>(kAlone + only);
      for (unsigned bits = these.pressed; bits != 0; bits &= bits - 1)
        pressed_[static_cast<std::size_t>(i + std::countr_zero(bits))] = presses;
      if (these.known == kAll) {
        enter(step, i, these.met, these);
        continue;
      }
      for (int lane = 0; lane < kLanes && i + lane < last; ++lane)
        if (const unsigned bit = 1u << lane; these.known & bit)
          enter(step, i, these.met & bit, these);
        else if (close.to(vector_at(step.q, i + lane)))
          settle_one(t, step, i + lane);
    }
    if (late) enter_late(step, free, first, last);
  }
}

void Settling::enter_late(const LyingStep& step, const Free& free, int begin, int end) {
  for (int i = begin; i < end; ++i) {
    const int k = i - begin;
    const Vec3 v(free.v[0][k], free.v[1][k], free.v[2][k]), now = vector_at(step.v, i);
    if (v == now) continue;
    const Vec3 x(free.q[0][k], free.q[1][k], free.q[2][k]);
    const double work = late_work(step.h, vector_at(step.q0, i), vector_at(step.v0, i), x, v, now);
    particles_->contacts().ledger().enter(i, particles_->masses()[static_cast<std::size_t>(i)],
                                          {work, 0});
  }
}

void Settling::settle_one(double t, const LyingStep& step, int i) {
  const double mass = particles_->masses()[static_cast<std::size_t>(i)];
  if (!(mass < HUGE_VAL)) return;
  const double h = step.h;
  const Vec3 x0 = vector_at(step.q0, i), v0 = vector_at(step.v0, i), x1 = vector_at(step.q, i);
  Vec3 place = x1, velocity = vector_at(step.v, i);
  Way way = step.whole ? Way::between(h, x0, v0, x1, velocity)
                       : Way{{x0, h * v0, x1 - x0 - h * v0, Vec3::Zero()}};
  const Contacts& contacts = particles_->contacts();
  if (!contacts.near(t, h, place, Vec3::Zero(), way.length())) return;
  if (!contacts.settle(t, h, i, mass, step.whole, way, place, velocity)) return;
  pressed_[static_cast<std::size_t>(i)] = way.pressed ? kSingly : 0;
  put_vector(step.q, i, place);
  put_vector(step.v, i, velocity);
}

// What happened to those of eight particles whose bits are set, in their order.
void Settling::enter(const LyingStep& step, int i, unsigned bits, const Lying& lying) {
  if (bits == 0) return;
  ContactLedger& ledger = particles_->contacts().ledger();
  ContactWork sum = ledger.sum_of(i);
  double known = 0, scaled = 0;
  for (; bits != 0; bits &= bits - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
    const double mass = particles_->masses()[static_cast<std::size_t>(i) + lane];
    if (mass != known) scaled = mass / (step.h * step.h), known = mass;
    sum.lost += scaled * lying.lost[lane];
    sum.given += scaled * lying.given[lane];
    if (step.whole && lying.pressed >> lane & 1) {
      sum.lost += mass * lying.lost_held[lane];
      sum.given += mass * lying.given_held[lane];
    }
    ledger.mark(i + static_cast<int>(lane));
  }
  ledger.sum_of(i) = sum;
}

void Settling::end(double t, double h, const In& q0, const In& v0, const Out& q, const Out& v,
                   int begin, int end) {
  LyingStep step = step_of(h, q0, v0, q, v);
  step.whole = true;
  settle(t, step, begin, end);
}

void Settling::drifted(double t, double h, const In& q0, const In& v0, const Out& q, const Out& v,
                       int begin, int end) {
  LyingStep step = step_of(h, q0, v0, q, v);
  settle(t, step, begin, end);
}

void Settling::kicked(double t, LyingKick kick, int begin, int end) {
  if (!will_hold(begin, end)) return;
  const Contacts& contacts = particles_->contacts();
  int known = 0;  // the collider that `kick` is of
  for (int i = begin; i < end; i += kLanes) {
    if (pressed_by(i) == 0) continue;
    const std::uint8_t* const pressed = pressed_.data() + i;
    unsigned bits = 0, by = 0;
    bool alone = true;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (pressed[lane] == 0) continue;
      alone = alone && pressed[lane] >= kAlone && (by == 0 || by == pressed[lane]);
      by = pressed[lane];
      bits |= 1u << lane;
    }
    Lying lying;
    if (alone && static_cast<int>(by) != known) {
      const Collider& collider = *contacts.all()[by - kAlone];
      kick.surface = collider.plain(t);
      kick.friction = collider.surface().friction;
      known = static_cast<int>(by);
    }
    alone = alone && lying_.hold(kick, i, bits, lying);
    for (; bits != 0; bits &= bits - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
      const int id = i + static_cast<int>(lane);
      if (alone)
        contacts.ledger().enter(id, particles_->masses()[static_cast<std::size_t>(id)],
                                {lying.lost_held[lane], lying.given_held[lane]});
      else
        hold_one(t, kick, id);
    }
  }
}

void Settling::hold_one(double t, const LyingKick& kick, int i) {
  const Vec3 held =
      particles_->contacts().hold(t, i, particles_->masses()[static_cast<std::size_t>(i)],
                                  vector_at(kick.q, i), vector_at(kick.v, i));
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

bool SettledStepper::step(double t, double h, int count, const double* x, double* x_next) {
  if (!stepper_->step(t, h, count, x, x_next)) return false;
  settling_.begin(t, t + h);
  const Layout& layout = particles_->layout();
  particles_->team().run_parts(layout.n(), 16, [&](int begin, int end) {
    settling_.end(t, h, layout.axes(x), layout.axes(x, 3), layout.axes(x_next),
                  layout.axes(x_next, 3), begin, end);
  });
  return settling_.succeeded();
}

}  // namespace sim
