#include "core/particles/constraints/held_events.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/particles/axes.h"

namespace sim {
namespace {

constexpr double kGlance = 1e-6;             // s, for differences
constexpr double kSlow = 1e-12;              // m/s, a closing that is none
constexpr double kInNoTime = 1e-10;          // s
constexpr double kSticksAtLeast = 1 - 1e-3;  // of what friction can, as it is found
constexpr double kStops = 1e6;  // times the momentum at hand: what nothing slips against

}  // namespace

HeldEvents::HeldEvents(Particles& particles, Holding& holding)
    : TouchEvents(particles),
      holding_(&holding),
      forces_(particles, holding.constraints(), holding.touching_count()),
      press_(particles, holding),
      values_(holding.constraints().rows()),
      accelerations_(Layout(particles.layout().n(), 3).size()) {}

void HeldEvents::begin_anew() {
  HeldEvents fresh(*particles_, *holding_);
  fresh.smooth_ = smooth_;
  *this = std::move(fresh);
}

// Within the step, for surfaces that were sampled for it alone; whatever its length, since a step
// is taken again from memory with the length that events left it.
TouchingForces::Look HeldEvents::look_at(double t) const {
  double d = t - t_ > 3 * kGlance ? -kGlance : kGlance;
  if (particles_->contacts().sampled()) d = std::clamp(d, -0.25 * h_, 0.25 * h_);
  return {.glance = d, .rubs = !smooth_};
}

bool HeldEvents::lies(int i, const Collider* collider) const {
  for (auto each = std::ranges::lower_bound(lying_, i, {}, &LyingOn::particle);
       each != lying_.end() && each->particle == i; ++each)
    if (each->collider == collider) return true;
  return false;
}

bool HeldEvents::evaluate(double t, const double* x) {
  const ParticleView now = particles_->view(t, x);
  const auto a = Layout(now.n, 3).axes(accelerations_.data());
  forces_.free(now, a);
  return values_.evaluate(now, x + holding_->memory_begin()) &&
         forces_.accelerate(now, values_, lying_, look_at(t), a);
}

bool HeldEvents::constrain(const ParticleView& view, const double* memory, double* const a[3]) {
  in_forces_ = true;
  return values_.evaluate(view, memory) &&
         forces_.accelerate(view, values_, lying_, look_at(view.t), {a[0], a[1], a[2]});
}

void HeldEvents::begin(double t, double h, const double* x) {
  begin_step(t, h);
  holding_->refuse({});
  find_lying(x);
}

// What lies on a surface, does not move off it, and is not about to.
void HeldEvents::find_lying(const double* x) {
  lying_.clear();
  pressed_.clear();
  const ParticleView view = particles_->view(t_, x);
  for (int i = 0; i < holding_->touching_count(); ++i) {
    if (!view.free(i)) continue;
    const Vec3 place = view.position(i), velocity = view.velocity(i);
    for (Collider* const collider : particles_->contacts().all()) {
      if (collider->clearance(t_, place, Vec3::Zero()) > kOn * place_size(place)) continue;
      const Touch touch = collider->touch(t_, place);
      const Vec3 relative = velocity - touch.velocity;
      const double rate = relative.dot(touch.normal);
      const double still = kStill * (velocity.norm() + touch.velocity.norm()) + kSlow;
      if (std::fabs(touch.gap) > kOn * place_size(place) || std::fabs(rate) > still) continue;
      const Vec3 slip = relative - rate * touch.normal;
      lying_.push_back(
          {.particle = i, .collider = collider, .slides = slip.norm() > still, .slip = slip});
    }
  }
  if (lying_.empty()) return;
  const auto a = Layout(view.n, 3).axes(accelerations_.data());
  const auto largest = [&] {
    double most = 0;
    for (int i = 0; i < view.n; ++i) most = std::max(most, vector_at(a, i).norm());
    return most;
  };
  // A slip that forces would make in no time is none.
  forces_.free(view, a);
  for (LyingOn& each : lying_)
    each.slides = each.slides && each.slip.norm() > kInNoTime * largest();
  if (!evaluate(t_, x)) {  // f will say so
    lying_.clear();
    return;
  }
  add_power(lying_, t_, x);
  for (std::size_t k = 0; k < lying_.size(); ++k) {
    lying_[k].surplus = forces_.surplus(k);
    pressed_.push_back(std::max(0.0, forces_.pushes()[k].force));
  }
  std::size_t kept = 0;
  const double size = largest();
  for (std::size_t k = 0; k < lying_.size(); ++k) {
    if (lying_[k].surplus < -kPressed * size) continue;
    lying_[kept] = lying_[k];
    pressed_[kept++] = pressed_[k];
  }
  lying_.resize(kept);
  pressed_.resize(kept);
}

void HeldEvents::add_power(std::span<LyingOn> lying, double t, const double* x) const {
  const ParticleView view = particles_->view(t, x);
  for (std::size_t k = 0; k < lying.size(); ++k) {
    const Push& push = forces_.pushes()[k];
    if (!push.acts) continue;
    const Vec3 force = push.force * push.normal + push.pull;
    const double given = force.dot(push.collider->touch(t, view.position(push.particle)).velocity);
    lying[k].power.given += given;
    lying[k].power.lost += given - force.dot(view.velocity(push.particle));
  }
}

// What ends on a surface needs no shorter step.
bool HeldEvents::at_end(double gap, const Vec3& place) const {
  return gap >= -kIn * place_size(place) && gap <= kOn * place_size(place);
}

double HeldEvents::first(double t, double h, const double* x, const double* x_next) {
  Earliest earliest;
  const HeldPress::Ends ends{t, h, x, x_next};
  const ParticleView before = particles_->view(t, x), after = particles_->view(t + h, x_next);
  if (smooth_) {
    find_others(ends);
    earliest.may_be(press_.next_cut());
    return earliest.s;
  }
  for (const int i : press_.near(ends)) {
    const Way way = Way::between(h, before.position(i), before.velocity(i), after.position(i),
                                 after.velocity(i));
    for (Collider* const collider : particles_->contacts().all()) {
      if (lies(i, collider)) continue;
      const double s = Contacts::first_touch(*collider, t, h, way);
      if (s <= 1 && !at_end(collider->touch(t + h, way.at(1)).gap, way.at(1))) earliest.may_be(s);
    }
  }
  if (lying_.empty() || !evaluate(t + h, x_next)) return earliest.s;
  for (std::size_t k = 0; k < lying_.size(); ++k) {
    const LyingOn& each = lying_[k];
    const double now = forces_.surplus(k);
    if (each.surplus > 0 && now < -1e-3 * each.surplus)
      earliest.may_be(each.surplus / (each.surplus - now));
    if (!each.slides || each.collider->surface().friction == 0) continue;
    const Touch touch = each.collider->touch(t + h, after.position(each.particle));
    const Vec3 slip = tangential(after.velocity(each.particle) - touch.velocity, touch.normal);
    const double size = each.slip.norm(), turned = slip.dot(each.slip) / size;
    if (turned < -1e-8 * size) earliest.may_be(size / (size - turned));
  }
  return earliest.s;
}

// What meets surfaces within a piece, beside what lies on them and what meets them at its end.
void HeldEvents::find_others(const HeldPress::Ends& ends) {
  press_.find(ends);
  const ParticleView after = particles_->view(ends.t + ends.r, ends.to);
  std::erase_if(press_.meetings(), [&](const HeldPress::Meeting& meeting) {
    return lies(meeting.particle, meeting.collider) ||
           (!meeting.known && at_end(meeting.gap, after.position(meeting.particle)));
  });
}

Events::Outcome HeldEvents::end(double t, double h, const double* x, double* x_next, bool cut) {
  const HeldPress::Piece piece{t, h, x, x_next, true};
  bool jumped = false;
  shown_.begin(t, h);
  press_.meetings().clear();
  if (smooth_ || !cut) find_others(piece.ends());
  bool allowed = put_back(piece) && press(piece, jumped);
  shown_.acted();
  if (allowed && press_.find_hits(t + h, x_next, kStill, kSlow)) {
    allowed = press_.press({t + h, 0, x_next, x_next, true}, 1, true);
    press_.enter();
    jumped = true;
  }
  shown_.happened();
  if (allowed) return outcome(jumped);
  if (holding_->refusal().empty())
    holding_->refuse("constraints and colliders: this step has no end");
  return Outcome::kNotAllowed;
}

// What lies has drifted off its surface by what the method is off.
bool HeldEvents::put_back(const HeldPress::Piece& piece) {
  const double end = piece.t + piece.r;
  pushes_.clear();
  if (!lying_.empty()) {
    if (!evaluate(end, piece.to)) return false;
    const ParticleView view = particles_->view(end, piece.to);
    const auto a = Layout(view.n, 3).axes(accelerations_.data());
    for (std::size_t k = 0; k < lying_.size(); ++k) shown_.steady(lying_[k].power, piece.r);
    add_power(lying_, end, piece.to);
    double speed = 0;
    for (int i = 0; i < view.n; ++i) speed = std::max(speed, view.velocity(i).norm());
    for (std::size_t k = 0; k < lying_.size(); ++k) {
      const LyingOn& each = lying_[k];
      const ContactWork work{.lost = 0.5 * piece.r * each.power.lost,
                             .given = 0.5 * piece.r * each.power.given};
      particles_->contacts().ledger().enter(each.particle, 1, work);
      Push push = forces_.pushes()[k];
      bool stops = false;
      pressed_[k] = 0.5 * piece.r * (pressed_[k] + std::max(0.0, push.force));
      // A slip that ends here, and what sticks still.
      if (push.acts && push.friction > 0) {
        const Touch touch = each.collider->touch(end, view.position(each.particle));
        const Vec3 slip = tangential(view.velocity(each.particle) - touch.velocity, touch.normal);
        const double most =
            std::max(each.slip.norm(), piece.r * vector_at(a, each.particle).norm());
        stops = each.slides ? slip.norm() <= 1e-7 * most
                            : push.pull.norm() < kSticksAtLeast * push.most_pull();
        const double mass = particles_->masses()[static_cast<std::size_t>(each.particle)];
        if (stops) push.spare = kStops * mass * std::max(speed, slip.norm());
      }
      push.friction = stops ? 1 : 0;
      push.least = 0;
      pushes_.push_back(push);
    }
  }
  return press_.put_back(piece, pushes_);
}

// Friction of what lies, where f has none, and what was met on the way without a cut.
bool HeldEvents::press(const HeldPress::Piece& piece, bool& jumped) {
  auto& meetings = press_.meetings();
  bool some = std::ranges::any_of(meetings, [](const auto& m) { return !m.known; });
  if (std::ranges::any_of(meetings, &HeldPress::Meeting::cuts))
    particles_->contacts().ledger().count_uncut();
  const ParticleView begin = particles_->view(piece.t, piece.from);
  for (std::size_t k = 0; k < lying_.size(); ++k) {
    HeldPress::Meeting meeting;
    meeting.particle = lying_[k].particle, meeting.collider = lying_[k].collider;
    meeting.normal = meeting.collider->touch(piece.t, begin.position(meeting.particle)).normal;
    meeting.known = true;
    if (smooth_ && pushes_[k].acts) meeting.pressed = pressed_[k];
    some = some || (meeting.pressed > 0 && meeting.collider->surface().friction > 0);
    meetings.push_back(meeting);
  }
  if (!some) return true;
  std::ranges::stable_sort(meetings, {}, &HeldPress::Meeting::particle);
  jumped = true;
  if (!press_.press(piece, 1, false)) return false;
  press_.enter();
  return true;
}

}  // namespace sim
