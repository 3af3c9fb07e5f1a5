#include "core/particles/particle_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/particles/explicit/embedded_rk_stepper.h"
#include "core/particles/explicit/rk_stepper.h"
#include "core/particles/explicit/split_stepper.h"
#include "core/particles/implicit/local_global_solver.h"
#include "core/particles/implicit/newton_solver.h"
#include "core/particles/implicit/particle_jacobian.h"
#include "core/simd/lanes.h"

namespace sim {
namespace {

constexpr int kEnergyTile = 4096;  // fixed, so that sums do not depend on the number of threads

template <class Sum>
double sum_over_tiles(int n, Sum sum_of) {
  double sum = 0;
  for (int begin = 0; begin < n; begin += kEnergyTile)
    sum += sum_of(Tile{begin, std::min(begin + kEnergyTile, n)});
  return sum;
}

// Throws unless the forces and masses can be had in single precision, with room for what a step
// makes of them.
void check_single(const ParticleSystem& system) {
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorKind::kScene, {"single precision does not fit", "", why, "use double"});
  };
  if (!system.nets().empty())
    refuse("springs that are not in runs of equal id differences are double precision only");
  for (const Force* force : system.other_forces())
    refuse("force '" + system.name_of(*force) + "' is double precision only");

  constexpr double kLeast = 1e-20, kMost = 1e20;
  const auto check = [&](double value, const std::string& what) {
    const double size = std::fabs(value);
    if (size != 0 && !(size >= kLeast && size <= kMost))
      refuse(what + " of " + shortest(value) + " is not between 1e-20 and 1e20");
  };
  const Motion& motion = system.motion();
  for (const double g : motion.gravity) check(g, "an acceleration");
  check(motion.damping, "a drag");
  for (const double mass : system.masses())
    if (std::isfinite(mass)) check(mass, "a mass");
  for (const SpringRun* run : system.runs())
    for (int a = 0; a + run->stride < system.layout().n(); ++a) {
      if (!run->owns(a)) continue;
      check(run->k_of(a), "a stiffness");
      check(run->k_of(a) * run->rest_of(a), "stiffness times rest length");
      if (run->uniform) break;
    }
}

}  // namespace

ParticleSystem::ParticleSystem(const std::vector<double>& masses, const std::vector<int>& pinned,
                               std::vector<std::unique_ptr<Force>> forces, const double* initial,
                               Team& team)
    : layout_(static_cast<int>(masses.size())),
      mass_(masses.size()),
      forces_(std::move(forces)),
      team_(&team) {
  set_masses(masses, pinned);

  std::vector<const Net*> nets;
  const ParticleView start = view(0, initial);
  for (const auto& force : forces_) {
    force->bind(start);
    if (const auto affine = force->affine()) {
      for (int axis = 0; axis < 3; ++axis) motion_.gravity[axis] += affine->acceleration[axis];
      motion_.damping += affine->damping;
    } else if (const Springs* springs = force->springs()) {
      for (const SpringRun& run : springs->runs()) {
        runs_.push_back(&run);
        reach_ = std::max(reach_, (run.stride + kGrain - 1) / kGrain * kGrain + kGrain);
      }
      if (!springs->net().empty()) nets.push_back(&springs->net());
      has_dashpots_ = has_dashpots_ || force->accumulates();
    }
    if (!force->accumulates()) continue;
    other_forces_.push_back(force.get());
    needs_velocities_ = needs_velocities_ || force->depends_on_velocity();
  }
  net_forces_ = NetForces(std::move(nets), layout_.n());
  for (int rank = 0; rank < team.size(); ++rank) rings_.emplace_back(runs_);
}

void ParticleSystem::set_masses(const std::vector<double>& masses, const std::vector<int>& pinned) {
  std::ranges::copy(masses, mass_.begin());
  for (const int i : pinned)
    mass_[static_cast<std::size_t>(i)] = std::numeric_limits<double>::infinity();

  // Free particles of one mass share a constant; otherwise every particle has its own.
  const std::size_t n = mass_.size();
  free_.assign(n / 8 + 2, 0);
  pinned_count_ = 0;
  motion_.inverse_mass = 0;
  bool uniform = true;
  for (std::size_t i = 0; i < n; ++i) {
    if (mass_[i] == std::numeric_limits<double>::infinity()) {
      ++pinned_count_;
      continue;
    }
    set_bit(free_.data(), static_cast<std::int64_t>(i));
    if (motion_.inverse_mass == 0) motion_.inverse_mass = 1 / mass_[i];
    uniform = uniform && 1 / mass_[i] == motion_.inverse_mass;
  }
  motion_.free = free_.data();
  motion_.inverse_masses = nullptr;
  if (!uniform) {
    inverse_mass_.assign(n + SpringRun::kPad, 0);
    for (std::size_t i = 0; i < n; ++i) inverse_mass_[i] = 1 / mass_[i];
    motion_.inverse_masses = inverse_mass_.data();
  }
}

ParticleView ParticleSystem::view(double t, const double* state) const {
  return {layout_.n(),
          t,
          layout_.block(state, 0),
          layout_.block(state, 1),
          layout_.block(state, 2),
          layout_.block(state, 3),
          layout_.block(state, 4),
          layout_.block(state, 5),
          mass_.data()};
}

double ParticleSystem::kinetic_energy(double t, const double* state) const {
  const ParticleView p = view(t, state);
  return sum_over_tiles(p.n, [&](Tile tile) {
    return 0.5 * sum_in_lanes(tile.begin, tile.end, [&](int i) {
             return p.free_mass(i) * (p.vx[i] * p.vx[i] + p.vy[i] * p.vy[i] + p.vz[i] * p.vz[i]);
           });
  });
}

double ParticleSystem::potential_energy(double t, const double* state) const {
  const ParticleView p = view(t, state);
  double sum = 0;
  for (const auto& force : forces_) {
    force->prepare(p, *team_);
    sum += sum_over_tiles(p.n, [&](Tile tile) { return force->potential(p, tile); });
  }
  return sum;
}

double ParticleSystem::elastic_energy(double t, const double* state) const {
  const ParticleView p = view(t, state);
  double sum = 0;
  for (const auto& force : forces_)
    if (force->springs())
      sum += sum_over_tiles(p.n, [&](Tile tile) { return force->potential(p, tile); });
  return sum;
}

// c sum |v|^2 of drag, less sum F.v over the forces F of dashpots: pinned particles have v = 0.
double ParticleSystem::damping_power(double t, const double* state, Array& sums) const {
  const ParticleView p = view(t, state);
  double power = motion_.damping * sum_in_lanes(0, p.n, [&](int i) {
                   return p.vx[i] * p.vx[i] + p.vy[i] * p.vy[i] + p.vz[i] * p.vz[i];
                 });
  if (!has_dashpots_) return power;
  std::ranges::fill(sums.span(), 0.0);
  const auto [fx, fy, fz] = Layout(p.n, 3).axes(sums.data());
  const ForceSink sink{fx, fy, fz};
  for (Force* force : other_forces_) {
    if (!force->springs()) continue;
    force->prepare(p, *team_);
    team_->run_parts(p.n, 8, [&](int begin, int end) { force->accumulate(p, {begin, end}, sink); });
  }
  power -= sum_in_lanes(0, p.n, [&](int i) {
    return sink.x[i] * p.vx[i] + sink.y[i] * p.vy[i] + sink.z[i] * p.vz[i];
  });
  return power;
}

std::string ParticleSystem::name_of(const Force& force) const {
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (forces_[i].get() == &force)
      return force.springs() && force.accumulates() ? names_[i] + " with damping" : names_[i];
  return "of no name";
}

void ParticleSystem::prepare_gather(const ParticleView& view) {
  net_forces_.prepare(view, *team_);
  for (Force* force : other_forces_) force->prepare(view, *team_);
}

void ParticleSystem::gather(const ParticleView& view, Tile tile, ForceSink sink) const {
  const int end = (tile.end + 7) / 8 * 8;  // nets add to whole blocks
  for (double* values : {sink.x, sink.y, sink.z}) std::fill(values + tile.begin, values + end, 0.0);
  net_forces_.add(view, tile, sink);
  for (const Force* force : other_forces_) force->accumulate(view, tile, sink);
}

void ParticleSystem::combine(const Stage& stage, double* out) {
  for_ranges(6,
             [&](std::size_t begin, std::size_t end) { combine_range_(stage, out, begin, end); });
}

void ParticleSystem::accelerate(const ParticleView& view, double* const a[3]) {
  // The other forces are gathered where the acceleration will stand.
  RkStage<double> sweep{};
  const double* const q[3] = {view.x, view.y, view.z};
  const double* const v[3] = {view.vx, view.vy, view.vz};
  for (int axis = 0; axis < 3; ++axis) {
    sweep.q[axis] = q[axis];
    sweep.v0[axis] = v[axis];
    sweep.a[axis] = a[axis];
    if (has_other_forces()) sweep.force[axis] = a[axis];
  }
  prepare_gather(view);
  team_->run([&](int rank) {
    const Part part = part_of(layout_.n(), 8, rank, team_->size());
    Rings<double>& rings = rings_[static_cast<std::size_t>(rank)];
    kernels_.start(rings, team_->size(), q, part.begin, reach_);
    for (int begin = part.begin; begin < part.end; begin += kGatherTile) {
      const Tile tile{begin, std::min(begin + kGatherTile, part.end)};
      if (has_other_forces()) gather(view, tile, {a[0], a[1], a[2]});
      kernels_.rk(rings, motion_, sweep, tile.begin, tile.end);
    }
  });
}

void ParticleSystem::eval(double t, const Stage& stage, double* y, double* dydt) {
  combine(stage, y);
  double* const a[3] = {layout_.block(dydt, 3), layout_.block(dydt, 4), layout_.block(dydt, 5)};
  accelerate(view(t, y), a);
  for (int axis = 0; axis < 3; ++axis)
    std::copy_n(layout_.block(y, 3 + axis), layout_.n(), layout_.block(dydt, axis));
}

std::unique_ptr<Stepper> ParticleSystem::explicit_stepper(const ExplicitPlan& plan) {
  if (plan.precision == Precision::kSingle) {
    check_single(*this);
    return std::make_unique<RkStepper<float>>(*this, plan);
  }
  return std::make_unique<RkStepper<double>>(*this, plan);
}

std::unique_ptr<EmbeddedStepper> ParticleSystem::embedded_stepper(const EmbeddedPlan& plan) {
  return std::make_unique<EmbeddedRkStepper>(*this, plan);
}

std::unique_ptr<Stepper> ParticleSystem::split_stepper(const SplitPlan& plan) {
  if (needs_velocities_ && plan.order > 2) return nullptr;
  if (plan.precision == Precision::kSingle) {
    check_single(*this);
    return std::make_unique<SplitStepper<float>>(*this, plan);
  }
  return std::make_unique<SplitStepper<double>>(*this, plan);
}

std::unique_ptr<StageSolver> ParticleSystem::stage_solver(const StageOptions& options) {
  if (options.method == StageOptions::Method::kLocalGlobal)
    return std::make_unique<LocalGlobalSolver>(*this, options);
  return std::make_unique<NewtonSolver>(*this, options);
}

std::unique_ptr<Jacobian> ParticleSystem::jacobian() {
  return std::make_unique<ParticleJacobian>(*this);
}

}  // namespace sim
