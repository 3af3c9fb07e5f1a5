// One piece of a step, in which it is known what touches.
#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/particles/axes.h"
#include "core/particles/constraints/held_press.h"
#include "core/particles/constraints/linear_rows.h"
#include "core/particles/late_velocities.h"

namespace sim {
namespace {

constexpr int kMostPressings = 12;       // of finding what pushes put into other surfaces
constexpr double kSlowSlip = 1e-10;      // of the velocities at hand: a slip that is none
constexpr double kLeastAlongPush = 0.1;  // of a normal, along the direction of its push
constexpr double kAgainst = 0.9;         // cosine of what acts against the slip
constexpr double kOfScene = 1e-15;       // of the size of the scene
constexpr double kPressSettled = 1e-13;  // where turns gain no more

Vec3 surface_velocity(const Push& push, double t, const Vec3& x) {
  return push.collider->touch(t, x).velocity;
}

}  // namespace

void HeldPress::begin_push(const Meeting& meeting, bool hit) {
  Push push;
  push.particle = meeting.particle, push.collider = meeting.collider;
  push.normal = meeting.normal, push.pressed = meeting.pressed;
  push.acts = push.held = (hit && !meeting.known) || meeting.pressed > 0;
  if (meeting.bounces)
    push.least = meeting.collider->surface().restitution_at(meeting.closing) * meeting.closing;
  pushes_.push_back(push);
}

bool HeldPress::press(const Piece& piece, double until, bool hit) {
  pushes_.clear();
  until_ = until;
  for (const Meeting& meeting : meetings_)
    if (meeting.known || meeting.s <= until) begin_push(meeting, hit);
  const double end = piece.t + piece.r, before = energy(end, piece.to);
  work_ = {};
  if (piece.r > 0) {
    std::copy_n(piece.to, free_.size(), free_.data());
    predict_friction(piece);
    if (!find_place(piece)) return false;
  }
  if (!find_velocity(piece)) return false;
  work_.lost = before - energy(end, piece.to) + work_.given + late(piece);
  return true;
}

double HeldPress::late(const Piece& piece) const {
  if (!first_order_ || piece.r == 0) return 0;
  const ParticleView from = particles_->view(piece.t, piece.from),
                     free = particles_->view(piece.t + piece.r, free_.data()),
                     to = particles_->view(piece.t + piece.r, piece.to);
  double sum = 0;
  for (int i = 0; i < to.n; ++i)
    if (to.free(i))
      sum += to.mass[i] * late_work(piece.r, from.position(i), from.velocity(i), free.position(i),
                                    free.velocity(i), to.velocity(i));
  return sum;
}

// Velocities as rows_ and moving_ want them, with friction. enough: of the fastest, where turns
// gain no more.
bool HeldPress::solve_velocities(const Piece& piece, double enough) {
  const auto v = particles_->layout().axes(piece.to, 3);
  const double speed = fastest(piece);
  struct Velocities final : LinearRows {
    using LinearRows::LinearRows;
    double gap(Push& push, const Vec3& y) override {
      return push.normal.dot(y - push.ground) - push.least;
    }
  } wanted(rows_, v, rows_.drive());
  wanted.row_tolerance = wanted.gap_tolerance = kOfScene * speed;
  wanted.enough = enough * speed;
  wanted.slow = kSlowSlip * speed;
  return solver_.solve(moving_, rows_.gradient(), v, wanted);
}

double HeldPress::fastest(const Piece& piece) const {
  double speed = 1e-30;
  const ParticleView view = particles_->view(piece.t + piece.r, piece.to);
  for (int i = 0; i < view.n; ++i) speed = std::max(speed, view.velocity(i).norm());
  for (const Push& push : moving_) speed = std::max(speed, push.ground.norm());
  return speed;
}

// The coefficient of the slip at the start of the piece.
double HeldPress::friction_of(const Push& push, const Piece& piece) const {
  const Surface surface = push.collider->surface();
  if (!surface.law) return surface.friction;
  const ParticleView from = particles_->view(piece.t, piece.from);
  const Touch touch = push.collider->touch(piece.t, from.position(push.particle));
  const Vec3 slip = from.velocity(push.particle) - touch.velocity;
  return surface.friction_at(tangential(slip, touch.normal).norm());
}

// What friction does in the piece: by the velocities at its end, were all impulses given there.
// Half of it acts along the surfaces of the start.
void HeldPress::predict_friction(const Piece& piece) {
  const Layout& layout = particles_->layout();
  const double end = piece.t + piece.r;
  const ParticleView from = particles_->view(piece.t, piece.from),
                     to = particles_->view(end, piece.to);
  const auto slip_at_start = [&](const Push& push) {
    const Vec3 u = push.collider->touch(piece.t, from.position(push.particle)).velocity;
    return tangential(from.velocity(push.particle) - u, push.normal);
  };
  moving_.clear();
  for (const Push& each : pushes_) {
    Push push = each;
    if (push.held && push.pressed == 0) continue;  // it hits
    const Touch touch = push.collider->touch(end, to.position(push.particle));
    push.friction = friction_of(push, piece);
    push.ground = touch.velocity, push.normal = touch.normal;
    push.spare = push.friction * push.pressed;
    push.acts = push.held = push.pressed > 0;
    moving_.push_back(push);
  }
  if (std::ranges::none_of(moving_, [](const Push& push) { return push.friction > 0; })) return;
  if (!rows_.evaluate(to, piece.to + holding_->memory_begin())) return;
  const bool found = solve_velocities(piece, 1e-9);
  for (int axis = 3; axis < 6; ++axis)
    std::copy_n(layout.block(free_.data(), axis), layout.n(), layout.block(piece.to, axis));
  if (!found) return;
  auto next = moving_.cbegin();
  for (Push& push : pushes_) {
    if (next == moving_.cend()) break;
    if (next->particle != push.particle || next->collider != push.collider) continue;
    if (next->acts) {
      // Against the slip of the start where it is all against it.
      const Vec3 slip = slip_at_start(push);
      const double size = slip.norm(), pull = next->pull.norm();
      push.rubbed = 0.5 * tangential(next->pull, push.normal);
      if (next->pull.dot(slip) < -kAgainst * size * pull)
        push.rubbed = -0.5 * std::min(pull, next->most_pull()) / size * slip;
    }
    ++next;
  }
}

// What other particles the pushes have put into a surface; not those that hit it by themselves, for
// which the step is cut where they do.
bool HeldPress::add_inside(const Piece& piece) {
  const double end = piece.t + piece.r;
  const std::size_t before = pushes_.size();
  find_near({end, 0, piece.to, piece.to});
  for (const int i : near_) {
    const Vec3 place = particles_->view(end, piece.to).position(i);
    for (Collider* const collider : particles_->contacts().all()) {
      const Touch touch = collider->touch(end, place);
      if (!(touch.gap < -Contacts::slack(place))) continue;
      const auto same = [&](const Push& p) { return p.particle == i && p.collider == collider; };
      if (std::any_of(pushes_.begin(), pushes_.begin() + static_cast<std::ptrdiff_t>(before), same))
        continue;
      if (std::ranges::any_of(meetings_, [&](const Meeting& m) {
            return m.particle == i && m.collider == collider && !m.known && m.s > until_;
          }))
        continue;
      Meeting meeting;
      meeting.particle = i, meeting.collider = collider, meeting.normal = touch.normal;
      begin_push(meeting, false);
    }
  }
  // New ones to their places by particle; a sort that is stable would allocate.
  for (auto next = pushes_.begin() + static_cast<std::ptrdiff_t>(before); next != pushes_.end();
       ++next) {
    const auto place =
        std::ranges::upper_bound(pushes_.begin(), next, next->particle, {}, &Push::particle);
    std::rotate(place, next, next + 1);
  }
  return pushes_.size() > before;
}

// Positions from those of the step without contact and what friction does to them.
bool HeldPress::place(const Piece& piece, bool nearest) {
  const Layout& layout = particles_->layout();
  const std::size_t memory = holding_->memory_begin();
  const double end = piece.t + piece.r;
  const auto q = layout.axes(piece.to);
  for (int axis = 0; axis < 3; ++axis)
    std::copy_n(layout.block(free_.data(), axis), layout.n(), layout.block(piece.to, axis));
  double size = holding_->constraints().size();
  for (Push& push : pushes_) {
    const auto i = static_cast<std::size_t>(push.particle);
    const Vec3 x = vector_at(q, push.particle);
    size = std::max(size, place_size(x));
    put_vector(q, push.particle, x + piece.r * holding_->constraints().weights()[i] * push.rubbed);
    push.acts = push.held;
  }
  struct Places final : PushSolver::Wanted {
    RowValues& values;
    const ParticleView now;
    const double* memory;
    Places(RowValues& of, const ParticleView& at, const double* with)
        : values(of), now(at), memory(with) {}
    bool rows(std::span<double> rest) override {
      if (!values.evaluate(now, memory)) return false;
      std::ranges::copy(values.phi(), rest.begin());
      return true;
    }
    double gap(Push& push, const Vec3& y) override {
      const Touch touch = push.collider->touch(now.t, y);
      if (nearest) push.normal = touch.normal;
      return touch.gap / std::max(kLeastAlongPush, push.normal.dot(touch.normal));
    }
  } wanted(rows_, particles_->view(end, piece.to), piece.to + memory);
  wanted.row_tolerance = kOfScene * size;
  wanted.gap_tolerance = 0.1 * Contacts::slack(Vec3(size, 0, 0));
  wanted.enough = kPressSettled * size;
  wanted.nearest = nearest;
  const std::span<const Vec3> gradient = nearest ? rows_.gradient() : start_rows_.gradient();
  bool found = solver_.solve(pushes_, gradient, q, wanted);
  for (int turn = 0; turn < kMostPressings && found && add_inside(piece); ++turn)
    found = solver_.go_on(pushes_, gradient, q, wanted);
  return found;
}

// Names the row that is off most, or a particle.
bool HeldPress::refuse(const std::string& unit) {
  const PushSolver::Worst& worst = solver_.worst();
  const RowList& list = holding_->constraints().rows();
  std::string who = "particle " + std::to_string(pushes_.empty() ? 0 : pushes_.front().particle);
  if (worst.row_id >= 0)
    who = "constraint '" + holding_->constraints().title(list.part_of(worst.row_id)) + "', " +
          list.name(worst.row_id);
  holding_->refuse(who + ": constraints and colliders leave no room, off by " +
                   brief(std::max(worst.row, -worst.gap), 3) + unit);
  return false;
}

bool HeldPress::find_place(const Piece& piece) {
  const Layout& layout = particles_->layout();
  const std::size_t memory = holding_->memory_begin();
  const ParticleView begin = particles_->view(piece.t, piece.from);
  if (!start_rows_.evaluate(begin, piece.from + memory)) return false;
  // The nearest place where rods pass each other in a line, so that rows change too much.
  if (!place(piece, false) && (!piece.last || !place(piece, true))) {
    return refuse(" m");
  }
  // Velocities have what the first half of the pushes gives them.
  const auto v = layout.axes(piece.to, 3);
  const std::span<const double> weights = holding_->constraints().weights();
  for (int i = 0; i < layout.n(); ++i)
    if (weights[static_cast<std::size_t>(i)] > 0)
      put_vector(v, i, vector_at(v, i) + solver_.added(i) / piece.r);
  for (const Push& push : pushes_) {
    const int i = push.particle;
    put_vector(v, i, vector_at(v, i) + weights[static_cast<std::size_t>(i)] * push.rubbed);
    work_.given += (push.force / piece.r * push.normal + push.rubbed)
                       .dot(surface_velocity(push, piece.t, begin.position(i)));
  }
  for (std::size_t r = 0; r < start_rows_.drive().size(); ++r)
    work_.given -= solver_.multipliers()[r] * start_rows_.drive()[r] / piece.r;
  holding_->constraints().follow(particles_->view(piece.t + piece.r, piece.to), piece.to + memory);
  return true;
}

bool HeldPress::find_velocity(const Piece& piece) {
  const Layout& layout = particles_->layout();
  const double end = piece.t + piece.r;
  const auto q = layout.axes(piece.to);
  if (!rows_.evaluate(particles_->view(end, piece.to), piece.to + holding_->memory_begin()))
    return false;
  moving_.clear();
  for (Push push : pushes_) {
    const Vec3 x = vector_at(q, push.particle);
    const Touch touch = push.collider->touch(end, x);
    if (!push.held && touch.gap > kFlush * place_size(x)) continue;
    push.friction = friction_of(push, piece);
    push.normal = touch.normal, push.ground = touch.velocity;
    // Of both halves together friction is what it may be.
    if (piece.r > 0 && push.friction > 0)
      push.spare = push.friction * std::max(0.0, push.force) / piece.r +
                   push.friction * push.pressed - push.rubbed.norm();
    push.acts = push.held = push.pressed > 0;
    moving_.push_back(push);
  }
  if (!solve_velocities(piece, 1e-12)) {
    if (!piece.last) return false;
    for (Push& push : moving_) push.friction = push.spare = 0;
    if (!solve_velocities(piece, 1e-6)) return refuse(" m/s");
  }
  for (const Push& push : moving_)
    if (push.acts) work_.given += (push.force * push.normal + push.pull).dot(push.ground);
  for (std::size_t r = 0; r < rows_.drive().size(); ++r)
    work_.given -= solver_.multipliers()[r] * rows_.drive()[r];
  return true;
}

}  // namespace sim
