#include "core/particles/constraints/constraint_system.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/particles/constraints/constraint_solver.h"
#include "core/particles/constraints/contact_accelerations.h"
#include "core/particles/particles.h"

namespace sim {
namespace {

constexpr double kFits = 1e-9;  // m, of rods between pins; smaller moves are not reported

// Throws unless each equation can be satisfied by moving free particles.
void check_directions(const Constraints& constraints, const RowValues& values,
                      const ParticleView& start) {
  const RowList& list = constraints.rows();
  for (int r = 0; r < list.rows(); ++r) {
    const auto row = static_cast<std::size_t>(r);
    bool joins_free = false, prescribed = false;
    for (int e = list.pattern.begin[row]; e < list.pattern.begin[row + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      if (!start.free(list.pattern.ids[at])) continue;
      joins_free = true;
      prescribed = prescribed || values.gradient()[at].squaredNorm() > 0;
    }
    const double off = std::fabs(values.phi()[row]);
    if (prescribed || !(off > kFits)) continue;
    const RowList::Part& part = list.part_of(r);
    throw Error(
        ErrorKind::kScene,
        {"constraint '" + constraints.title(part) + "'", constraints.place(part),
         list.name(r) +
             (joins_free ? " has no direction at the start: its particles are at "
                           "one place"
                         : " joins pinned particles alone and is off by " + brief(off, 3) + " m"),
         joins_free ? "move one of them" : "unpin one, or give it the length it has"});
  }
}

}  // namespace

ConstraintSystem::ConstraintSystem(Particles& particles) : particles_(&particles) {}

ConstraintSystem::~ConstraintSystem() = default;

void ConstraintSystem::add(std::unique_ptr<Constraint> constraint, const std::string& name,
                           const std::string& place, double feedback, const double* initial) {
  constraints_.add(std::move(constraint), name, place, feedback, particles_->view(0, initial));
}

void ConstraintSystem::begin() {
  constraints_.set_masses(particles_->masses());
  solver_ = std::make_unique<ConstraintSolver>(constraints_, &particles_->pool());
  observer_.reset();
  contact_accelerations_.reset();
}

void ConstraintSystem::refresh() {
  constraints_.refresh();
  begin();
}

bool ConstraintSystem::add_constraint_forces(const ParticleView& view, const double* memory,
                                             double* const a[3]) {
  if (solver_->accelerate(view, memory, {a[0], a[1], a[2]})) return true;
  // Positions that are not finite are reported by the caller.
  const auto n = static_cast<std::size_t>(view.n);
  if (all_finite({view.x, n}) && all_finite({view.y, n}) && all_finite({view.z, n}))
    refuse(solver_->refusal());
  return false;
}

bool ConstraintSystem::project_state(double t, double* state, bool near) {
  const Layout& layout = particles_->layout();
  double* const memory = state + internal_begin();
  const ParticleView view = particles_->view(t, state);
  const bool settled =
      solver_->project_state(t, view, layout.axes(state), layout.axes(state, 3), memory, near);
  if (settled)
    constraints_.follow(view, memory);
  else
    refuse(solver_->refusal());
  return settled;
}

bool ConstraintSystem::project_positions(double t, double* state, bool near) {
  const Layout& layout = particles_->layout();
  return solver_->project_positions(t, particles_->view(t, state), layout.axes(state),
                                    layout.axes(state, 3), state + internal_begin(), near);
}

bool ConstraintSystem::project_velocities(double t, double* state) {
  const Layout& layout = particles_->layout();
  return solver_->rattle_velocities(t, particles_->view(t, state), layout.axes(state),
                                    layout.axes(state, 3), state + internal_begin(),
                                    constraints_.weights());
}

void ConstraintSystem::start(double* state) {
  const Layout& layout = particles_->layout();
  double* const memory = state + internal_begin();
  const ParticleView start = particles_->view(0, state);
  constraints_.start(memory);
  RowValues values(constraints_.rows());
  if (values.evaluate(start, memory)) check_directions(constraints_, values, start);

  // The distance of the projection of the initial state, and the kinetic energy that it takes.
  const std::vector<double> before(state, state + layout.size());
  const double kinetic = particles_->kinetic_energy(0, state);
  if (!project_state(0, state, false))
    throw Error(ErrorKind::kScene,
                {"constraints that cannot be met", constraints_.place(constraints_.rows().parts[0]),
                 "at the start " + solver_->refusal(),
                 "change positions or lengths so that all of them fit"});
  notes_ = constraints_.notes();
  double moved = 0;
  for (std::size_t k = layout.offset(0); k < layout.offset(3); ++k)
    moved = std::max(moved, std::fabs(state[k] - before[k]));
  if (moved > kFits * constraints_.size())
    notes_.push_back("the constraints moved particles by up to " + brief(moved, 3) +
                     " m at the start, where they were not obeyed");
  const double taken = kinetic - particles_->kinetic_energy(0, state);
  if (std::fabs(taken) > kFits * kinetic)
    notes_.push_back("the constraints took " + brief(taken, 3) +
                     " J at the start, from velocities that did not obey them");
  if (const RowMatrix& matrix = solver_->matrix(); matrix.dependent() > 0)
    notes_.push_back("constraints depend on each other at the start (" +
                     std::to_string(matrix.dependent()) + " of " +
                     std::to_string(constraints_.rows().rows()) + " equations, the first is " +
                     constraints_.rows().name(matrix.first_dependent()) +
                     "): their forces are those of least norm, and have no bound where they are "
                     "taut");
}

// The constraint forces follow from the accelerations that the particles would have without them.
bool ConstraintSystem::observe(const ParticleView& now, const double* state) {
  if (!observer_) observer_ = std::make_unique<ConstraintSolver>(constraints_, &particles_->pool());
  const Layout half(now.n, 3);
  if (sums_.size() == 0) sums_ = Array(half.size());
  const auto a = half.axes(sums_.data());
  particles_->accelerate(now, a.data());
  particles_->prescribed().accelerate(now.t, a);
  return observer_->accelerate(now, state + internal_begin(), a);
}

std::span<const double> ConstraintSystem::multipliers(double t, const double* state) {
  const ParticleView now = particles_->view(t, state);
  if (!observe(now, state)) return {};
  if (!joins_contact()) return observer_->multipliers();
  if (!contact_accelerations_)
    contact_accelerations_ =
        std::make_unique<ContactAccelerations>(*particles_, constraints_, contact_count_);
  return contact_accelerations_->multipliers(now, observer_->values());
}

std::vector<ConstraintForce> ConstraintSystem::forces(double t, const double* state) {
  std::vector<ConstraintForce> list;
  const std::span<const double> multipliers = this->multipliers(t, state);
  if (multipliers.empty()) return list;

  // Two-particle constraints are reported row by row, all others as forces on each particle.
  const RowList& rows = constraints_.rows();
  std::vector<std::size_t> place(static_cast<std::size_t>(particles_->layout().n()));
  for (std::size_t p = 0; p < rows.parts.size(); ++p) {
    const RowList::Part& part = rows.parts[p];
    const int end = rows.end_of(p);
    const std::size_t first = list.size();
    for (int r = part.row; r < end; ++r) {
      const auto row = static_cast<std::size_t>(r);
      const auto begin = static_cast<std::size_t>(rows.pattern.begin[row]);
      const auto after = static_cast<std::size_t>(rows.pattern.begin[row + 1]);
      const double lambda = multipliers[row];
      const std::span<const Vec3> gradient = observer_->values().gradient();
      if (after - begin == 2) {
        const Vec3 force = lambda * gradient[begin];
        list.push_back({constraints_.title(part), rows.name(r), rows.pattern.ids[begin],
                        rows.pattern.ids[begin + 1], -lambda * gradient[begin].norm(), force});
        continue;
      }
      for (std::size_t e = begin; e < after; ++e) {
        const int i = rows.pattern.ids[e];
        std::size_t& own = place[static_cast<std::size_t>(i)];
        if (own < first || own >= list.size() || list[own].a != i || list[own].b >= 0) {
          own = list.size();
          list.push_back({constraints_.title(part), "", i, -1, 0, {}});
        }
        list[own].force += lambda * gradient[e];
      }
    }
    for (std::size_t k = first; k < list.size(); ++k)
      if (list[k].b < 0) list[k].tension = list[k].force.norm();
  }
  return list;
}

// (J^T lambda).v = -lambda.drive, because J v + drive = 0, less the power at pinned particles that
// move.
double ConstraintSystem::driving_power(double t, const double* state) {
  if (!observe(particles_->view(t, state), state)) return std::nan("");
  return observer_->values().driving_power(observer_->multipliers(), particles_->view(t, state));
}

std::size_t ConstraintSystem::internal_begin() const noexcept {
  return particles_->layout().size() + particles_->internal_size();
}

bool ConstraintSystem::joins_contact() const {
  return contact_count_ > 0 && !particles_->contacts().empty();
}

ConstraintDrift ConstraintSystem::drift(double t, const double* state) const {
  RowValues values(constraints_.rows());
  if (!values.evaluate(particles_->view(t, state), state + internal_begin()))
    return {HUGE_VAL, HUGE_VAL};
  std::vector<double> rate(values.phi().size());
  values.times(particles_->layout().axes(state, 3).data(), rate.data());
  ConstraintDrift drift;
  for (std::size_t r = 0; r < rate.size(); ++r) {
    drift.position = std::max(drift.position, std::fabs(values.phi()[r]));
    drift.velocity = std::max(drift.velocity, std::fabs(rate[r] + values.drive()[r]));
  }
  return drift;
}

}  // namespace sim
