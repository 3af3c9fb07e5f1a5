#include "constrained_islands.h"

#include <algorithm>
#include <cmath>

#include "core/math/axes.h"
#include "core/particles/particles.h"

namespace sim {
namespace {

constexpr double kPieceShareUsed = 0.8;              // of the share known to be free
constexpr int kPieceHalvings = 8;                    // before an island moves as one
constexpr int kHalvingsToRest = kPieceHalvings + 1;  // and before it does not move
constexpr double kNoPull = 1e-9;                     // of a gradient: a row that fixes nothing

}  // namespace

ConstrainedIslands::ConstrainedIslands(Particles& particles, ConstraintSystem& constraint_system)
    : particles_(&particles),
      constraint_system_(&constraint_system),
      start_(constraint_system.internal_begin() + constraint_system.internal_size()),
      end_(start_.size()),
      joined_(slot(particles.layout().n())),
      sums_(joined_.size()),
      goal_(joined_.size()),
      rows_(constraint_system.constraints().rows()) {}

void ConstrainedIslands::begin(double t, double h, const double* x, const double* x_next) {
  t_ = t, t_end_ = t + h;
  std::copy_n(x, start_.size(), start_.data());
  std::copy_n(x_next, end_.size(), end_.data());
  near_ = found_ = sharing_ = false;
  culprit_ = -1;
}

void ConstrainedIslands::load(std::span<const Vec3> from, std::span<const Vec3> displacement) {
  const auto q = particles_->layout().axes(end_.data());
  for (std::size_t i = 0; i < from.size(); ++i)
    put_vector(q, static_cast<int>(i), from[i] + displacement[i]);
}

bool ConstrainedIslands::project_displacements(std::span<const Vec3> from,
                                               std::span<Vec3> displacement,
                                               std::span<std::uint8_t> touched,
                                               std::span<std::uint8_t> dirty) {
  load(from, displacement);
  if (!constraint_system_->project_positions(t_end_, end_.data(), near_)) return false;
  near_ = true;
  const auto q = particles_->layout().axes(end_.data());
  const std::span<const double> weights = constraint_system_->constraints().weights();
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (weights[i] == 0) continue;
    const Vec3 place = from[i] + displacement[i], held = vector_at(q, static_cast<int>(i));
    if (held == place) continue;
    displacement[i] = held - from[i];
    touched[i] = dirty[i] = 1;
  }
  return true;
}

bool ConstrainedIslands::project_velocities(std::span<const Vec3> from,
                                            std::span<const Vec3> displacement,
                                            std::span<Vec3> velocity,
                                            std::span<std::uint8_t> touched) {
  load(from, displacement);
  const auto v = particles_->layout().axes(end_.data(), 3);
  for (std::size_t i = 0; i < velocity.size(); ++i) put_vector(v, static_cast<int>(i), velocity[i]);
  if (!constraint_system_->project_velocities(t_end_, end_.data())) return false;
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const Vec3 held = vector_at(v, static_cast<int>(i));
    if (held != velocity[i]) touched[i] = 1;
    velocity[i] = held;
  }
  return true;
}

void ConstrainedIslands::unite(int a, int b) {
  const auto [low, high] = std::minmax({root(a), root(b)});
  if (low == high) return;
  joined_.join(low, high);
  Sum &to = sums_[slot(low)], &of = sums_[slot(high)];
  to.share = std::min(to.share, of.share);
  to.slowed = std::max(to.slowed, of.slowed);
  to.shorter = to.shorter || of.shorter;
  to.met = to.met || of.met;
  to.bound = to.bound || of.bound;
}

void ConstrainedIslands::find_islands() {
  if (found_) return;
  found_ = true;
  const std::span<const double> weights = constraint_system_->constraints().weights();
  joined_.separate(joined_.size());
  std::ranges::fill(sums_, Sum{});
  // A row fixes an island in space unless it allows a common translation; so does a pin.
  const RowPattern& pattern = constraint_system_->constraints().rows().pattern;
  rows_.evaluate(particles_->view(t_, start_.data()),
                 start_.data() + constraint_system_->internal_begin());
  for (int r = 0; r < pattern.rows(); ++r) {
    Vec3 sum = Vec3::Zero();
    double size = 0;
    int first = -1;
    bool pinned = false;
    for (int e = pattern.begin[slot(r)]; e < pattern.begin[slot(r) + 1]; ++e) {
      const int i = pattern.ids[slot(e)];
      const Vec3& gradient = rows_.gradient()[slot(e)];
      sum += gradient;
      size += gradient.norm();
      if (weights[slot(i)] == 0)
        pinned = true;
      else if (first < 0)
        first = i;
      else
        unite(first, i);
    }
    if (first >= 0 && (pinned || sum.norm() > kNoPull * size || rows_.drive()[slot(r)] != 0))
      sums_[slot(root(first))].bound = true;
  }
}

void ConstrainedIslands::join(const std::array<int, 4>& ids, double s) {
  const std::span<const double> weights = constraint_system_->constraints().weights();
  int first = -1;
  for (const int id : ids) {
    if (weights[slot(id)] == 0) continue;
    if (first < 0)
      first = id;
    else
      unite(first, id);
  }
  if (first < 0) {
    culprit_ = ids[0];
    return;
  }
  Sum& sum = sums_[slot(root(first))];
  sum.met = true;
  if (!sum.shorter) sum.share = std::min(sum.share, kPieceShareUsed * s);
}

bool ConstrainedIslands::slow(std::span<const std::uint8_t> which) {
  const std::span<const double> weights = constraint_system_->constraints().weights();
  bool any = false;
  for (std::size_t i = 0; i < which.size(); ++i) {
    if (!which[i] || weights[i] == 0) continue;
    Sum& sum = sums_[slot(root(static_cast<int>(i)))];
    if (sum.slowed > kHalvingsToRest) continue;
    if (!sum.shorter) sum.share = 0.5;
    sum.met = any = true;
  }
  return any;
}

bool ConstrainedIslands::spread(std::span<std::uint8_t> marks) {
  find_islands();
  bool free = true;
  for (Sum& sum : sums_) sum.marked = false;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i]) sums_[slot(root(static_cast<int>(i)))].marked = true;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const Sum& sum = sums_[slot(root(static_cast<int>(i)))];
    if (!sum.marked) continue;
    marks[i] = 1;
    free = free && !sum.bound;
  }
  return free;
}

void ConstrainedIslands::share(std::span<const Vec3> goal) {
  if (sharing_) return;
  find_islands();
  sharing_ = true;
  std::ranges::copy(goal, goal_.begin());
}

void ConstrainedIslands::add_up(std::span<const Vec3> of) {
  const std::span<const double> weights = constraint_system_->constraints().weights();
  for (Sum& sum : sums_) sum.moment = {}, sum.mass = 0;
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (weights[i] == 0) continue;
    Sum& sum = sums_[slot(root(static_cast<int>(i)))];
    sum.mass += 1 / weights[i];
    sum.moment += of[i] / weights[i];
  }
}

Vec3 ConstrainedIslands::shared(int i, const Vec3& of) {
  const Sum& sum = sums_[slot(root(i))];
  if (!sum.shorter) return of;
  const double share = sum.slowed > kPieceHalvings ? 0 : std::ldexp(sum.share, -sum.slowed);
  const Vec3 kinematic_motion =
      sum.bound || sum.slowed > kHalvingsToRest ? Vec3::Zero() : sum.moment / sum.mass;
  return kinematic_motion + share * (of - kinematic_motion);
}

// Slows each island with a collision by one more level; false if one has no level left.
bool ConstrainedIslands::slow_met() {
  for (std::size_t i = 0; i < sums_.size() && culprit_ < 0; ++i) {
    Sum& sum = sums_[i];
    if (root(static_cast<int>(i)) != static_cast<int>(i) || !sum.met) continue;
    if (sum.slowed > kHalvingsToRest) culprit_ = static_cast<int>(i);
    if (sum.shorter) ++sum.slowed;
    sum.shorter = true;
    sum.met = false;
  }
  return culprit_ < 0;
}

bool ConstrainedIslands::apply(std::span<const Vec3> from, std::span<Vec3> displacement,
                               std::span<std::uint8_t> touched, std::span<std::uint8_t> dirty) {
  const std::span<const double> weights = constraint_system_->constraints().weights();
  while (slow_met()) {
    add_up(goal_);
    for (std::size_t i = 0; i < displacement.size(); ++i) {
      if (weights[i] == 0) continue;
      const Vec3 left = shared(static_cast<int>(i), goal_[i]);
      if (left == goal_[i]) continue;
      displacement[i] = left;
      touched[i] = dirty[i] = 1;
    }
    if (project_displacements(from, displacement, touched, dirty)) return true;
    for (std::size_t i = 0; i < sums_.size(); ++i)
      if (sums_[i].shorter) sums_[slot(root(static_cast<int>(i)))].met = true;
  }
  return false;
}

void ConstrainedIslands::share_velocities(std::span<Vec3> velocity) {
  if (!sharing_) return;
  const std::span<const double> weights = constraint_system_->constraints().weights();
  add_up(velocity);
  for (std::size_t i = 0; i < velocity.size(); ++i)
    if (weights[i] > 0) velocity[i] = shared(static_cast<int>(i), velocity[i]);
}

void ConstrainedIslands::follow(double* x_next) const {
  constraint_system_->constraints().follow(particles_->view(t_end_, x_next),
                                           x_next + constraint_system_->internal_begin());
}

}  // namespace sim
