#include "rigid_contact.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace sim {
namespace {

constexpr double kOverlap = 1e-11;  // of a radius: what is left where bodies overlap
constexpr double kSettled = 1e-12;  // of the velocities at hand: where the solver stops
constexpr int kMostPasses = 20;

// Turned by the angle vector w, to third order, by a rotation to the last bit (Cayley).
Vec3 turned_over(const Vec3& r, const Vec3& w) {
  const Vec3 half = 0.5 * w, across = half.cross(r);
  return r + 2 / (1 + half.squaredNorm()) * (across + half.cross(across));
}

Mat3 turned_over(const Mat3& axes, const Vec3& w) {
  return transposed({turned_over(axes.column(0), w), turned_over(axes.column(1), w),
                     turned_over(axes.column(2), w)});
}

}  // namespace

// Impulses for what touches, and then for what these bring to touch.
double RigidContact::solve(double h) {
  impulses_.prepare(movers_, meets_);
  double scale = 0;
  bool bounces = false;
  for (const Meet& m : meets_) {
    if (!m.active) continue;
    const bool hits = m.before < -2 * std::fabs(m.given);
    bounces = bounces || (hits && m.restitution > 0);
    scale = std::max(
        scale, std::fabs(m.before) + std::fabs(m.given) + Impulses::velocity(movers_, m).norm());
  }
  if (bounces) impulses_.bounce(movers_, meets_, h);
  impulses_.start(movers_, meets_);
  double change = 0;
  for (int round = 0; round < kMostPasses; ++round) {
    change = impulses_.rest(movers_, meets_, kSettled * scale);
    bool all = true;
    for (Meet& m : meets_) {
      if (m.active) continue;
      const double gap = m.gap + Impulses::moved(movers_, m);
      if (gap >= -kNoGap * reach_[static_cast<std::size_t>(m.first)].scale) continue;
      const double rate = m.normal.dot(Impulses::velocity(movers_, m));
      if (!(rate < 0)) continue;
      m.active = true, all = false;
      m.lever = std::clamp(gap / rate, 0.0, h);
      scale = std::max(scale, -rate);
    }
    if (all) break;
  }
  counts_.fastest = std::max(counts_.fastest, scale);
  return change > kSettled * scale ? change : 0;
}

// What impulses of contact alone would move, as constraints let it move.
void RigidContact::link_moves() {
  moves_ = movers_;
  for (Mover& each : moves_) each.velocity = each.shift, each.spin = each.turn;
  joints_->begin_moves();
  joints_->hold(moves_, false);
  joints_->end_moves();
  for (std::size_t i = 0; i < movers_.size(); ++i)
    movers_[i].shift = moves_[i].velocity, movers_[i].turn = moves_[i].spin;
}

// What overlaps is moved apart in the metric of the masses, again until it does not.
void RigidContact::separate(double t) {
  const auto now = [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    RigidState state = reach_[at].after;
    state.center += movers_[at].shift;
    state.axes = turned_over(state.axes, movers_[at].turn);
    return state;
  };
  std::vector<Meet>& meets = overlaps_;
  for (int round = 0; round < kMostPasses; ++round) {
    meets.clear();
    double deepest = 0;
    // Each pair once: its meetings stand behind each other.
    for (std::size_t k = 0; k < meets_.size(); ++k) {
      const Meet& of = meets_[k];
      if (k > 0 && meets_[k - 1].first == of.first && meets_[k - 1].second == of.second &&
          meets_[k - 1].collider == of.collider)
        continue;
      points_.clear();
      const RigidState a = now(of.first);
      RigidState b;
      if (of.second >= 0) {
        b = now(of.second);
        solids_.touch(of.first, a, of.second, b, 0, points_);
      } else {
        solids_.touch(of.first, a, static_cast<std::size_t>(of.collider), t, 0, points_);
      }
      for (const TouchPoint& point : points_) {
        Meet m;
        m.first = of.first, m.second = of.second, m.collider = of.collider;
        m.normal = point.normal, m.arm1 = point.x - a.center, m.arm2 = point.x - b.center;
        m.offset = point.gap, m.active = true;
        meets.push_back(m);
        deepest = std::max(deepest, -point.gap / reach_[static_cast<std::size_t>(of.first)].scale);
      }
    }
    if (deepest <= kOverlap) return;
    // Places in the role of velocities.
    moves_.resize(movers_.size());
    for (std::size_t i = 0; i < movers_.size(); ++i) {
      moves_[i] = movers_[i];
      moves_[i].velocity = moves_[i].spin = {};
    }
    if (joints_) joints_->begin_moves();
    impulses_.prepare(moves_, meets);
    impulses_.rest(moves_, meets, 1e-3 * kOverlap);
    if (joints_) joints_->end_moves();
    for (std::size_t i = 0; i < movers_.size(); ++i) {
      movers_[i].shift += moves_[i].velocity;
      movers_[i].turn += moves_[i].spin;
    }
  }
}

void RigidContact::store(double* x_next) {
  const auto q = particles_->layout().axes(x_next), v = particles_->layout().axes(x_next, 3);
  for (std::size_t i = 0; i < movers_.size(); ++i) {
    const Mover& mover = movers_[i];
    const RigidState& free = reach_[i].after;
    if (mover.inverse_mass == 0 || (mover.velocity == free.velocity && mover.spin == free.spin &&
                                    mover.shift == Vec3() && mover.turn == Vec3()))
      continue;
    const auto bodies = static_cast<std::size_t>(solids_.bodies());
    if (i >= bodies) {
      const int id = entered_[i - bodies];
      for (std::size_t axis = 0; axis < 3; ++axis)
        q[axis][id] += mover.shift[axis], v[axis][id] = mover.velocity[axis];
      continue;
    }
    // Of a body that was turned the angular momentum stays, not the spin.
    RigidState now = free;
    now.axes = turned_over(free.axes, mover.turn);
    const RigidBody& body = solids_.body(static_cast<int>(i));
    const Vec3 spin = mover.turn == Vec3()
                          ? mover.spin
                          : body.inverse_inertia(now) * (body.inertia(free) * mover.spin);
    for (int p = 0; p < RigidBody::kParticles; ++p) {
      const int id = body.first() + p;
      const Vec3 r = turned_over(Vec3(q[0][id], q[1][id], q[2][id]) - free.center, mover.turn);
      const Vec3 place = free.center + mover.shift + r, rate = mover.velocity + spin.cross(r);
      for (std::size_t axis = 0; axis < 3; ++axis)
        q[axis][id] = place[axis], v[axis][id] = rate[axis];
    }
  }
}

bool RigidContact::resolve(double t, double h, const double* x, double* x_next) {
  refusal_.clear();
  // Single particles among colliders.
  const Layout& layout = particles_->layout();
  bool changed = false;
  if (const int others = solids_.singles(); settling_ && others > 0) {
    settling_->begin(t, t + h);
    settling_->end(t, h, layout.axes(x), layout.axes(x, 3), layout.axes(x_next),
                   layout.axes(x_next, 3), 0, others);
    if (!settling_->succeeded())
      refusal_ = "particle " + std::to_string(particles_->contacts().ledger().squeezed()) +
                 " is squeezed between colliders and has no room left";
    changed = true;
  } else if (settling_) {
    settling_->begin(t, t + h);
  }

  const Step step{t, h, x, x_next};
  load(step);
  find(step);
  const bool touches = std::ranges::any_of(meets_, &Meet::active);
  if (!touches) {
    kept_.clear();
    return changed;
  }
  if (joints_) {
    joints_->begin(solids_, entered_, t + h, x_next);
    impulses_.keep_to(joints_.get());
  }
  const double unsettled = solve(h);
  counts_.unsettled = std::max(counts_.unsettled, unsettled);
  if (joints_) link_moves();
  separate(t + h);
  const auto energy = [&] {
    return particles_->kinetic_energy(t + h, x_next) + particles_->potential_energy(t + h, x_next);
  };
  const double before = energy();
  store(x_next);
  if (joints_ && !joints_->store(x_next)) refusal_ = joints_->refusal();
  work_ += before - energy();
  keep();
  return true;
}

// The impulses of this step, for the next.
void RigidContact::keep() {
  kept_.clear();
  int most = 0;
  for (const Meet& m : meets_) {
    if (!m.active) continue;
    ++most;
    if (m.push > 0)
      kept_.push_back({m.key1, m.key2, m.feature, m.pull_u * m.u + m.pull_v * m.v, m.push});
  }
  counts_.most = std::max(counts_.most, most);
  // Particles are movers in the order in which they came.
  if (!entered_.empty())
    std::ranges::sort(kept_, {},
                      [](const Kept& k) { return std::tuple(k.first, k.second, k.feature); });
}

std::vector<double> RigidContact::memory() const {
  std::vector<double> numbers;
  for (const Kept& k : kept_)
    numbers.insert(numbers.end(),
                   {static_cast<double>(k.first), static_cast<double>(k.second),
                    static_cast<double>(k.feature), k.pull[0], k.pull[1], k.pull[2], k.push});
  return numbers;
}

void RigidContact::recall(std::span<const double> memory) {
  kept_.clear();
  const auto whole = [](double x) {  // whatever a file says
    return std::fabs(x) < 1e9 ? static_cast<int>(x) : 0;
  };
  for (std::size_t k = 0; k + kNumbers <= memory.size(); k += kNumbers)
    kept_.push_back({whole(memory[k]),
                     whole(memory[k + 1]),
                     whole(memory[k + 2]),
                     {memory[k + 3], memory[k + 4], memory[k + 5]},
                     memory[k + 6]});
}

double RigidContact::take_work() { return std::exchange(work_, 0.0); }

}  // namespace sim
