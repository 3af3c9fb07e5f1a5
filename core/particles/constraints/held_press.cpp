#include "core/particles/constraints/held_press.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/particles/axes.h"

namespace sim {
namespace {

constexpr int kMostMoments = 3;  // at which hits cut a step, if it is not that they must
constexpr double kSlips = 1e-9;  // of the velocities at hand: a slip that is none
constexpr int kAtOnce = 128;
constexpr std::size_t kFew = 1000;  // that touch more than one collider; more make room

}  // namespace

HeldPress::HeldPress(Particles& particles, Holding& holding, bool first_order)
    : particles_(&particles),
      holding_(&holding),
      first_order_(first_order),
      start_rows_(holding.constraints().rows()),
      rows_(holding.constraints().rows()),
      solver_(holding.constraints()),
      free_(holding.memory_begin() + holding.memory_size()) {
  const auto n = static_cast<std::size_t>(particles.layout().n());
  near_.reserve(n);
  for (std::vector<Push>* pushes : {&pushes_, &moving_}) pushes->reserve(n + kFew);
  meetings_.reserve(n + kFew);
}

void HeldPress::find_near(const Ends& ends) {
  near_.clear();
  const double t = ends.t, r = ends.r;
  const ParticleView begin = particles_->view(t, ends.from), end = particles_->view(t + r, ends.to);
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

bool HeldPress::look(const Ends& ends, int i, Collider& collider, Meeting& meeting) const {
  const ParticleView begin = particles_->view(ends.t, ends.from),
                     end = particles_->view(ends.t + ends.r, ends.to);
  const Vec3 x0 = begin.position(i), v0 = begin.velocity(i), v1 = end.velocity(i);
  const Touch start = collider.touch(ends.t, x0);
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
    const Way way = Way::between(ends.r, x0, v0, end.position(i), v1);
    meeting.s = Contacts::first_touch(collider, ends.t, ends.r, way);
    if (!(meeting.s <= 1)) return false;
    const Vec3 place = way.at(meeting.s);
    const Touch touch = collider.touch(ends.t + meeting.s * ends.r, place);
    meeting.normal = touch.normal;
    meeting.closing =
        std::max(0.0, -touch.normal.dot(way.rate(meeting.s) / ends.r - touch.velocity));
    speed = touch.normal.dot(v1 - touch.velocity);
  }
  if (meeting.known) return true;
  meeting.gained = std::fabs(speed - rate0);
  const Touch end_touch = collider.touch(ends.t + ends.r, end.position(i));
  meeting.gap = end_touch.gap;
  meeting.through = end_touch.gap > 0 || end_touch.normal.dot(meeting.normal) < 0.5;
  // A bounce that would not end within what is left of the ends.
  const double e = collider.surface().restitution_at(meeting.closing);
  meeting.bounces = e > 0 && 2 * e * meeting.closing > (1 - meeting.s) * meeting.gained;
  meeting.cuts = meeting.through || meeting.bounces || (e == 0 && meeting.closing > meeting.gained);
  return true;
}

void HeldPress::find(const Ends& ends) {
  meetings_.clear();
  find_near(ends);
  for (const int i : near_)
    for (Collider* const collider : particles_->contacts().all())
      if (Meeting meeting; look(ends, i, *collider, meeting)) meetings_.push_back(meeting);
}

// The first hit, unless there are too many.
double HeldPress::next_cut() const {
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

double HeldPress::energy(double t, const double* state) const {
  return particles_->kinetic_energy(t, state) + particles_->potential_energy(t, state);
}

// The work of the last press, and whom it touched.
void HeldPress::enter() {
  ContactLedger& ledger = particles_->contacts().ledger();
  ContactWork work = work_;
  for (const auto* pushes : {&pushes_, &moving_})
    for (const Push& push : *pushes)
      if (push.acts) ledger.enter(push.particle, 1, std::exchange(work, {}));
  if (work.lost != 0 && !pushes_.empty()) ledger.enter(pushes_.front().particle, 1, work);
}

bool HeldPress::put_out(double t, const double* x, double* to) {
  const Piece piece{t, 0, x, to, true};
  pushes_.clear();
  meetings_.clear();
  for (double* each : {to, free_.data()}) std::copy_n(x, free_.size(), each);
  if (!add_inside(piece)) return false;
  const double before = energy(t, x);
  const bool known = start_rows_.evaluate(particles_->view(t, x), x + holding_->memory_begin());
  work_ = {};
  if (!known || !(place(piece, false) || place(piece, true)) || !find_velocity(piece)) {
    std::copy_n(x, free_.size(), to);  // the step will say so
    return true;
  }
  work_.lost = before - energy(t, to) + work_.given;
  enter();
  return true;
}

bool HeldPress::put_back(const Piece& piece, std::span<const Push> lying) {
  const double end = piece.t + piece.r;
  std::copy_n(piece.to, free_.size(), free_.data());
  until_ = -1;
  pushes_.assign(lying.begin(), lying.end());
  if (!add_inside(piece) && lying.empty()) return true;
  bool pulls = true;
  for (Push& push : pushes_) push.held = push.acts;
  if (!place(piece, true)) {
    // What pushes may contradict rods by what the method is off.
    pulls = false;
    for (Push& push : pushes_) push.held = false;
    if (!place(piece, true)) return refuse(" m");
  }
  double* const memory = piece.to + holding_->memory_begin();
  holding_->constraints().follow(particles_->view(end, piece.to), memory);
  if (!rows_.evaluate(particles_->view(end, piece.to), memory)) return false;
  // Of what was inside alone the velocities are what they are: it hits.
  moving_.assign(lying.begin(), lying.end());
  const auto q = particles_->layout().axes(piece.to);
  for (Push& push : moving_) {
    const Touch touch = push.collider->touch(end, vector_at(q, push.particle));
    push.normal = touch.normal, push.ground = touch.velocity;
    push.held = pulls && push.acts;
  }
  return solve_velocities(piece, 1e-12) || refuse(" m/s");
}

bool HeldPress::find_hits(double t, const double* x, double still, double slow) {
  meetings_.clear();
  find_near({t, 0, x, x});
  const ParticleView now = particles_->view(t, x);
  bool hits = false;
  for (const int i : near_) {
    const Vec3 place = now.position(i), v = now.velocity(i);
    for (Collider* const collider : particles_->contacts().all()) {
      const Touch touch = collider->touch(t, place);
      if (touch.gap > kFlush * place_size(place)) continue;
      Meeting meeting;
      meeting.particle = i, meeting.collider = collider, meeting.normal = touch.normal;
      meeting.closing = std::max(0.0, touch.normal.dot(touch.velocity - v));
      meeting.known = !(meeting.closing > slow + still * (v.norm() + touch.velocity.norm()));
      meeting.bounces = !meeting.known && collider->surface().restitution > 0;
      hits = hits || !meeting.known;
      meetings_.push_back(meeting);
    }
  }
  return hits;
}

}  // namespace sim
