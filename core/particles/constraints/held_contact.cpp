#include "core/particles/constraints/held_contact.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/particles/axes.h"

namespace sim {
namespace {

constexpr double kNever = 2;        // a place on the way that is none
constexpr double kTogether = 1e-6;  // of a piece: what hits at once
constexpr int kMostMoments = 3;     // at which hits cut a step, if it is not that they must
constexpr int kMostCuts = 64;       // of a step
constexpr int kMostHalvings = 3;    // of what has no end
constexpr double kFails = -1;
constexpr double kSlips = 1e-9;  // of the velocities at hand: a slip that is none
constexpr int kAtOnce = 128;
constexpr std::size_t kFew = 1000;  // that touch more than one collider; more make room

}  // namespace

HeldContact::HeldContact(Particles& particles, Holding& holding)
    : particles_(&particles),
      holding_(&holding),
      start_rows_(holding.constraints().rows()),
      rows_(holding.constraints().rows()),
      solver_(holding.constraints()),
      start_(holding.memory_begin() + holding.memory_size()),
      free_(start_.size()) {
  const auto n = static_cast<std::size_t>(particles.layout().n());
  near_.reserve(n);
  for (std::vector<Push>* pushes : {&pushes_, &moving_}) pushes->reserve(n + kFew);
  meetings_.reserve(n + kFew);
}

void HeldContact::find_near(double t, double r, const double* from, const double* to) {
  near_.clear();
  const ParticleView begin = particles_->view(t, from), end = particles_->view(t + r, to);
  const Contacts& contacts = particles_->contacts();
  const auto way_of = [&](int i) {
    return Way::between(r, begin.position(i), begin.velocity(i), end.position(i), end.velocity(i))
        .length();
  };
  for (int first = 0; first < holding_->touching_count(); first += kAtOnce) {
    const int last = std::min(first + kAtOnce, holding_->touching_count());
    Vec3 low = end.position(first), high = low;
    double longest = 0;
    for (int i = first; i < last; ++i) {
      low = low.cwiseMin(end.position(i));
      high = high.cwiseMax(end.position(i));
      longest = std::max(longest, way_of(i));
    }
    const Vec3 middle = 0.5 * (low + high), half = 0.5 * (high - low);
    const double margin = kFlush * place_size(low.cwiseAbs().cwiseMax(high.cwiseAbs()));
    if (!contacts.near(t, r, middle, half, longest + margin)) continue;
    for (int i = first; i < last; ++i)
      if (end.free(i) && contacts.near(t, r, end.position(i), Vec3::Zero(), way_of(i) + margin))
        near_.push_back(i);
  }
}

bool HeldContact::look(const Piece& piece, int i, Collider& collider, Meeting& meeting) const {
  const ParticleView begin = particles_->view(piece.t, piece.from),
                     end = particles_->view(piece.t + piece.r, piece.to);
  const Vec3 x0 = begin.position(i), v0 = begin.velocity(i), v1 = end.velocity(i);
  const Touch start = collider.touch(piece.t, x0);
  const double rate0 = start.normal.dot(v0 - start.velocity);
  meeting = {};
  meeting.particle = i, meeting.collider = &collider;
  double speed = 0;
  if (start.gap <= kFlush * place_size(x0)) {
    meeting.known = rate0 >= -kSlips * (v0.norm() + start.velocity.norm()) - 1e-14;
    meeting.normal = start.normal;
    meeting.closing = std::max(0.0, -rate0);
    speed = start.normal.dot(v1 - start.velocity);
  } else {
    const Way way = Way::between(piece.r, x0, v0, end.position(i), v1);
    meeting.s = Contacts::first_touch(collider, piece.t, piece.r, way);
    if (!(meeting.s <= 1)) return false;
    const Vec3 place = way.at(meeting.s);
    const Touch touch = collider.touch(piece.t + meeting.s * piece.r, place);
    meeting.normal = touch.normal;
    meeting.closing =
        std::max(0.0, -touch.normal.dot(way.rate(meeting.s) / piece.r - touch.velocity));
    speed = touch.normal.dot(v1 - touch.velocity);
  }
  if (meeting.known) return true;
  meeting.gained = std::fabs(speed - rate0);
  const Touch end_touch = collider.touch(piece.t + piece.r, end.position(i));
  meeting.through = end_touch.gap > 0 || end_touch.normal.dot(meeting.normal) < 0.5;
  // A bounce that would not end within what is left of the piece.
  const double e = collider.surface().restitution;
  meeting.bounces = e > 0 && 2 * e * meeting.closing > (1 - meeting.s) * meeting.gained;
  meeting.cuts = meeting.through || meeting.bounces || (e == 0 && meeting.closing > meeting.gained);
  return true;
}

void HeldContact::find(const Piece& piece) {
  meetings_.clear();
  find_near(piece.t, piece.r, piece.from, piece.to);
  for (const int i : near_)
    for (Collider* const collider : particles_->contacts().all())
      if (Meeting meeting; look(piece, i, *collider, meeting)) meetings_.push_back(meeting);
}

// The first hit, unless there are too many.
double HeldContact::next_cut() const {
  double first = kNever, must = kNever;
  double moments[kMostMoments + 1];
  int count = 0;
  for (const Meeting& meeting : meetings_) {
    if (meeting.known || !meeting.cuts) continue;
    first = std::min(first, meeting.s);
    if (meeting.through) must = std::min(must, meeting.s);
    bool other = count <= kMostMoments;
    for (int k = 0; k < count && other; ++k) other = std::fabs(moments[k] - meeting.s) > kTogether;
    if (other) moments[count++] = meeting.s;
  }
  return count <= kMostMoments ? first : must;
}

double HeldContact::energy(double t, const double* state) const {
  return particles_->kinetic_energy(t, state) + particles_->potential_energy(t, state);
}

// The work of the last press, and whom it touched.
void HeldContact::enter() {
  ContactLedger& ledger = particles_->contacts().ledger();
  ContactWork work = work_;
  for (const auto* pushes : {&pushes_, &moving_})
    for (const Push& push : *pushes)
      if (push.acts) ledger.enter(push.particle, 1, std::exchange(work, {}));
  if (work.lost != 0 && !pushes_.empty()) ledger.enter(pushes_.front().particle, 1, work);
}

// What a hand put into a surface is put out, without velocity: true where start_ is that state.
bool HeldContact::put_out(double t, const double* x) {
  const Piece piece{t, 0, x, start_.data(), true};
  pushes_.clear();
  for (Array* each : {&start_, &free_}) std::copy_n(x, start_.size(), each->data());
  if (!add_inside(piece)) return false;
  const double before = energy(t, x);
  const bool known = start_rows_.evaluate(particles_->view(t, x), x + holding_->memory_begin());
  work_ = {};
  if (!known || !(place(piece, false) || place(piece, true)) || !find_velocity(piece)) {
    std::copy_n(x, start_.size(), start_.data());  // the step will say so
    return true;
  }
  work_.lost = before - energy(t, start_.data()) + work_.given;
  enter();
  return true;
}

// The state at the end of a piece, or false where there is none.
bool HeldContact::advance(Stepper& stepper, const Piece& piece, bool again) {
  if (again) stepper.restart();
  if (piece.r > 0) return stepper.step(piece.t, piece.r, 1, piece.from, piece.to);
  std::copy_n(piece.from, start_.size(), piece.to);
  return true;
}

// How much of a piece was made, as a share of it; < 0: it has no end.
double HeldContact::make(Stepper& stepper, const Piece& piece, bool again, bool may_cut) {
  const Contacts& contacts = particles_->contacts();
  if (!advance(stepper, piece, again)) return kFails;
  find(piece);
  if (meetings_.empty()) return 1;
  touched_ = true;
  // What lies on surfaces is pressed on first, for it changes where others go.
  if (std::ranges::any_of(meetings_, &Meeting::known)) {
    if (!press(piece, -1, false)) return kFails;
    find(piece);
  }
  const bool hits = std::ranges::any_of(meetings_, [](const Meeting& m) { return !m.known; });
  const double s = may_cut ? next_cut() : kNever;
  if (s == kNever && hits) {
    if (std::ranges::any_of(meetings_, &Meeting::cuts)) contacts.ledger().count_uncut();
    if (!advance(stepper, piece, true) || !press(piece, 1, false)) return kFails;
  } else if (s < 1) {
    Piece before = piece;
    before.r = s * piece.r;
    if (!advance(stepper, before, true) || !press(before, s + kTogether, true)) return kFails;
  }
  if (!all_finite({piece.to, start_.size()})) return kFails;
  enter();
  return s;
}

bool HeldContact::step(Stepper& stepper, double t, double h, const double* x, double* x_next) {
  const Contacts& contacts = particles_->contacts();
  contacts.ledger().begin_step();
  if (contacts.sampled()) contacts.look(t, t + h);
  Piece piece{t, h, x, x_next};
  touched_ = false;
  bool again = put_out(t, x);
  if (again) piece.from = start_.data();
  int smaller = 0;
  for (int cuts = 0;; ++cuts) {
    holding_->refuse({});
    piece.last = smaller == kMostHalvings;
    const double made = make(stepper, piece, again, cuts < kMostCuts);
    again = again || touched_;
    if (made < 0) {
      if (piece.last || !touched_) {
        // Where numbers are not finite they say it themselves.
        const bool finite = all_finite({x_next, start_.size()});
        if (finite && holding_->refusal().empty())
          holding_->refuse("constraints and colliders: this step has no end");
        if (finite || !holding_->refusal().empty()) std::copy_n(x, start_.size(), x_next);
        return false;
      }
      piece.r *= 0.5;
      ++smaller;
      continue;
    }
    const double now = piece.t + std::min(made, 1.0) * piece.r;
    if (!(now < t + h * (1 - kTogether * kTogether))) break;
    std::copy_n(x_next, start_.size(), start_.data());
    piece = {now, t + h - now, start_.data(), x_next};
  }
  if (again) stepper.restart();
  return all_finite({x_next, start_.size()});
}

}  // namespace sim
