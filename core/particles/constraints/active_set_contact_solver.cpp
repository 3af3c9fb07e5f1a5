#include "core/particles/constraints/active_set_contact_solver.h"

#include <algorithm>
#include <cmath>

#include "core/math/axes.h"

namespace sim {
namespace {

constexpr int kMaxIterations = 200, kFrozenAfter = 25, kMostChanges = 6;
constexpr double kStickingGain = 0.5, kStiffening = 10;
constexpr double kDamping = 1e-3;        // for rows that nearly depend on each other
constexpr double kDiverges = 1e3;        // times the first residual
constexpr double kSameDirection = 1e-4;  // remainder of a normal in the span of others

}  // namespace

ActiveSetContactSolver::ActiveSetContactSolver(const Constraints& constraints)
    : constraints_(&constraints),
      matrix_(constraints.structure()),
      group_of_(constraints.weights().size(), -1),
      projected_(constraints.rows().pattern.ids.size()),
      rest_(static_cast<std::size_t>(constraints.rows().rows())),
      mu_(rest_.size()),
      base_(3 * constraints.weights().size()),
      added_(base_.size()),
      row_forces_(base_.size()) {}

Vec3 ActiveSetContactSolver::vector_of(const std::vector<double>& field, int i) const {
  const std::size_t n = group_of_.size(), at = static_cast<std::size_t>(i);
  return {field[at], field[n + at], field[2 * n + at]};
}

void ActiveSetContactSolver::add_to(std::vector<double>& field, int i, const Vec3& by) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    field[axis * group_of_.size() + static_cast<std::size_t>(i)] += by[axis];
}

void ActiveSetContactSolver::gather(std::span<ContactForce> contacts) {
  for (const Group& group : groups_) group_of_[static_cast<std::size_t>(group.particle)] = -1;
  groups_.clear();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (groups_.empty() || groups_.back().particle != contacts[k].particle) {
      group_of_[static_cast<std::size_t>(contacts[k].particle)] = static_cast<int>(groups_.size());
      groups_.emplace_back().particle = contacts[k].particle;
      groups_.back().begin = k;
    }
    groups_.back().end = k + 1;
  }
}

// Gram-Schmidt orthogonalisation of the normals of the active contacts, in their order.
void ActiveSetContactSolver::span_normals(Group& group,
                                          std::span<const ContactForce> contacts) const {
  group.rank = 0;
  for (std::size_t k = group.begin; k < group.end; ++k) {
    if (!contacts[k].active || group.rank == 3) continue;
    const Vec3 left = along(group, contacts[k].normal);
    const double size = left.norm();
    if (size < kSameDirection) continue;
    group.basis[group.rank] = left / size;
    group.of[group.rank++] = k;
  }
}

// The component of a vector tangential to all active surfaces.
Vec3 ActiveSetContactSolver::along(const Group& group, const Vec3& v) const {
  Vec3 left = v;
  for (int k = 0; k < group.rank; ++k) left -= group.basis[k].dot(left) * group.basis[k];
  return left;
}

// Splits the force on a particle into normal forces, solved from the last basis vector back, and a
// tangential (friction) force.
void ActiveSetContactSolver::distribute_force(const Group& group, std::span<ContactForce> contacts,
                                              const Vec3& force) const {
  for (std::size_t k = group.begin; k < group.end; ++k)
    contacts[k].force = 0, contacts[k].friction_force = {};
  for (int k = group.rank; k-- > 0;) {
    double part = group.basis[k].dot(force);
    for (int l = k + 1; l < group.rank; ++l)
      part -= contacts[group.of[l]].force * group.basis[k].dot(contacts[group.of[l]].normal);
    ContactForce& contact = contacts[group.of[k]];
    contact.force = part / group.basis[k].dot(contact.normal);
  }
  if (group.rank > 0) contacts[group.of[0]].friction_force = along(group, force);
}

// Moves the particles with active contacts onto their surfaces and updates the active set. `late`:
// viscosities are frozen, and no contact is released any more.
ActiveSetContactSolver::Moved ActiveSetContactSolver::shift(std::span<ContactForce> contacts,
                                                            const Axes& y, Problem& problem,
                                                            bool late) {
  constexpr double kTensileTolerance = 1e-9;  // of the largest force
  Moved moved;
  double largest = 0, poison = 0;
  worst_.gap = 0;
  for (Group& group : groups_) {
    const double weight = constraints_->weights()[static_cast<std::size_t>(group.particle)];
    const Vec3 force =
        (vector_of(added_, group.particle) - vector_of(row_forces_, group.particle)) / weight;
    distribute_force(group, contacts, force);
    const Vec3 now = vector_at(y, group.particle);
    bool changed = false;
    double friction = 0;
    for (std::size_t k = group.begin; k < group.end; ++k) {
      ContactForce& contact = contacts[k];
      contact.gap = problem.gap(contact, now);
      worst_.gap = std::min(worst_.gap, contact.gap);
      largest = std::max(largest, std::fabs(contact.force));
      if (contact.active && !contact.bilateral && !late &&
          contact.force < -kTensileTolerance * largest_ && contact.changes < kMostChanges) {
        contact.active = false;
        ++contact.changes;
        changed = true;
      } else if (!contact.active && contact.gap < -problem.gap_tolerance) {
        contact.active = changed = true;
      }
      if (contact.active && contact.friction > 0) friction += contact.max_friction();
    }
    span_normals(group, contacts);
    moved.changed = moved.changed || changed;

    // Normal displacement: back-substitution along the orthogonal basis of the normals.
    Vec3 displacement;
    int rank = 0;
    for (std::size_t k = group.begin; k < group.end; ++k) {
      if (!contacts[k].active) continue;
      const double missing = -contacts[k].gap - contacts[k].normal.dot(displacement);
      if (rank < group.rank && group.of[rank] == k) {
        displacement += missing / group.basis[rank].dot(contacts[k].normal) * group.basis[rank];
        ++rank;
      } else if (missing > 0 && group.rank < 3) {
        displacement += missing * contacts[k].normal;
      }
    }
    // Tangential displacement, under friction.
    if (group.rank == 0) {
      if (!late) group.viscosity = 0;
      group.mobility = 1;
      displacement = -weight * force;
    } else if (group.rank < 3) {
      const Vec3 slip = along(group, now - contacts[group.of[0]].surface_velocity);
      if (!late) set_viscosity(group, friction, slip.norm(), problem.slow);
      group.mobility = 1 / (1 + weight * group.viscosity);
      moved.has_friction = moved.has_friction || group.viscosity > 0;
      displacement -= weight * group.mobility * (along(group, force) + group.viscosity * slip);
    }
    moved.largest_change = std::max(moved.largest_change, displacement.norm());
    poison += 0 * displacement.norm();
    add_to(added_, group.particle, displacement);
    for (std::size_t axis = 0; axis < 3; ++axis)
      y[axis][group.particle] =
          base_[axis * group_of_.size() + static_cast<std::size_t>(group.particle)] +
          vector_of(added_, group.particle)[axis];
  }
  largest_ = largest;
  moved.largest_change += poison;
  return moved;
}

// The viscosity whose drag at this slip is the friction limit `most`. A contact whose drag is far
// below the limit is taken to stick.
void ActiveSetContactSolver::set_viscosity(Group& group, double most, double slip,
                                           double slow) const {
  const double pull = group.viscosity * slip, last = group.viscosity;
  group.viscosity = most / std::max(slip, slow);
  if (pull > 0 && pull < kStickingGain * most)
    group.viscosity = std::min(std::max(group.viscosity, kStiffening * last), most / slow);
}

void ActiveSetContactSolver::project(std::span<const Vec3> gradient, double shift) {
  std::ranges::copy(gradient, projected_.begin());
  const std::vector<int>& ids = constraints_->rows().pattern.ids;
  for (std::size_t e = 0; e < ids.size(); ++e) {
    const int at = group_of_[static_cast<std::size_t>(ids[e])];
    if (at < 0) continue;
    const Group& group = groups_[static_cast<std::size_t>(at)];
    if (group.rank == 0) continue;
    projected_[e] =
        group.rank == 3 ? Vec3() : std::sqrt(group.mobility) * along(group, gradient[e]);
  }
  matrix_.factorise(projected_, constraints_->weights(), shift);
}

// Applies the row multipliers: y -= W J^T A^-1 rest, in the directions tangential to the contacts.
void ActiveSetContactSolver::take(std::span<const Vec3> gradient, const Axes& y) {
  matrix_.solve(rest_.data());
  const RowPattern& pattern = constraints_->rows().pattern;
  const std::span<const double> weights = constraints_->weights();
  const std::size_t n = weights.size();
  for (std::size_t r = 0; r < rest_.size(); ++r) {
    mu_[r] -= rest_[r];
    for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const auto i = static_cast<std::size_t>(pattern.ids[at]);
      const double s = -weights[i] * rest_[r];
      const int pushed = group_of_[i];
      const double along =
          pushed < 0 ? s : s * std::sqrt(groups_[static_cast<std::size_t>(pushed)].mobility);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        added_[axis * n + i] += along * projected_[at][axis];
        row_forces_[axis * n + i] += s * gradient[at][axis];
      }
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < n; ++i)
      if (weights[i] > 0) y[axis][i] = base_[axis * n + i] + added_[axis * n + i];
}

bool ActiveSetContactSolver::solve(std::span<ContactForce> contacts, std::span<const Vec3> gradient,
                                   const Axes& y, Problem& problem) {
  const std::size_t n = group_of_.size();
  for (std::size_t axis = 0; axis < 3; ++axis) std::copy_n(y[axis], n, base_.data() + axis * n);
  for (std::vector<double>* each : {&added_, &row_forces_, &mu_}) std::ranges::fill(*each, 0.0);
  largest_ = 0;
  for (ContactForce& contact : contacts) contact.changes = 0;
  return go_on(contacts, gradient, y, problem);
}

bool ActiveSetContactSolver::go_on(std::span<ContactForce> contacts, std::span<const Vec3> gradient,
                                   const Axes& y, Problem& problem) {
  gather(contacts);
  for (Group& group : groups_) span_normals(group, contacts);
  double before = HUGE_VAL, first = 0;
  for (int turn = 0; turn < kMaxIterations; ++turn) {
    const Moved moved = shift(contacts, y, problem, turn >= kFrozenAfter);
    if (!problem.rows(rest_)) return false;
    if (turn == 0 || moved.changed || problem.nearest ||
        (moved.has_friction && turn <= kFrozenAfter))
      project(gradient, problem.nearest ? kDamping : 0);
    worst_.row = 0;
    for (std::size_t r = 0; r < rest_.size(); ++r)
      if (const double off = std::fabs(rest_[r]); !(off <= worst_.row)) {
        worst_.row = off;
        worst_.row_id = static_cast<int>(r);
      }
    const double now = std::max(moved.largest_change, worst_.row) + 0 * moved.largest_change;
    if (turn == 0) first = now;
    if (!(now <= kDiverges * first)) return false;
    if (!moved.changed && (!moved.has_friction || turn > 2)) {
      if (moved.largest_change <= problem.gap_tolerance && worst_.row <= problem.row_tolerance)
        return true;
      if (now <= problem.enough && !(now < 0.5 * before)) return true;
    }
    before = moved.changed ? HUGE_VAL : now;
    take(gradient, y);
  }
  return false;
}

}  // namespace sim
