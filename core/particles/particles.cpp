#include "core/particles/particles.h"

#include <algorithm>
#include <limits>

#include "core/base/assert.h"
#include "core/base/bits.h"
#include "core/particles/explicit/sweep.h"
#include "core/particles/springs/net_forces.h"
#include "core/particles/step_correction.h"
#include "core/simd/lanes.h"

namespace sim {

std::unique_ptr<StepCorrection> Force::correction(Particles& /*particles*/) { return nullptr; }
namespace {

constexpr int kEnergyTile = 4096;  // fixed, so that sums do not depend on the number of threads

// The reach of a sweep, in whole blocks, for springs between ids that far apart.
int whole_reach(std::int64_t distance) {
  return static_cast<int>((distance + kGrain - 1) / kGrain * kGrain + kGrain);
}

// The largest reach of the sweeps of these forces; -1 if one of them has no sweep.
int reach_of(std::span<Force* const> forces) {
  int reach = 0;
  for (const Force* force : forces) {
    const std::unique_ptr<ForceSweep> sweep = force->sweep();
    if (!sweep) return -1;
    reach = std::max(reach, sweep->reach());
  }
  return reach;
}

template <class Sum>
double sum_over_tiles(int n, Sum sum_of) {
  double sum = 0;
  for (int begin = 0; begin < n; begin += kEnergyTile)
    sum += sum_of(Tile{begin, std::min(begin + kEnergyTile, n)});
  return sum;
}

}  // namespace

struct Particles::Sums {
  NetForces net_forces;
  SweepKernels<double> kernels = sweep_kernels<double>();
  std::vector<Rings<double>> rings;  // of accelerate(), one a rank
};

Particles::Particles(const std::vector<double>& masses, const std::vector<int>& pinned,
                     std::vector<std::unique_ptr<Force>> forces, const double* initial,
                     ThreadPool& pool)
    : layout_(static_cast<int>(masses.size())),
      mass_(masses.size()),
      forces_(std::move(forces)),
      pool_(&pool),
      sums_(std::make_unique<Sums>()) {
  set_masses(masses, pinned);

  ParticleView start = view(0, initial);
  start.internal = {};
  for (const auto& force : forces_) {
    force->bind(start);
    add_internal(*force);
  }
  set_off({}, {});
}

Particles::~Particles() = default;

std::span<const Net* const> Particles::nets() const noexcept { return sums_->net_forces.nets(); }

void Particles::set_off(std::span<const std::size_t> forces,
                        std::span<const std::size_t> colliders) {
  SIM_ASSERT(std::ranges::all_of(forces, [&](std::size_t i) { return i < forces_.size(); }));
  contacts_.set_off(colliders);
  for (double& g : motion_.gravity) g = 0;
  motion_.damping = 0;
  reach_ = 0;
  needs_velocities_ = has_dashpots_ = false;
  on_.clear();
  runs_.clear();
  other_forces_.clear();
  std::vector<const Net*> nets;
  for (std::size_t i = 0; i < forces_.size(); ++i)
    if (!std::ranges::binary_search(forces, i)) add(*forces_[i], nets);
  sums_->net_forces = NetForces(std::move(nets), layout_.n());
  const int others_reach = reach_of(other_forces_);
  all_swept_ = !other_forces_.empty() && sums_->net_forces.nets().empty() && others_reach >= 0;
  if (all_swept_) reach_ = std::max(reach_, whole_reach(others_reach));
  sums_->rings.clear();
  for (int rank = 0; rank < pool_->most(); ++rank) sums_->rings.emplace_back(runs_);

  prepared_ = other_forces_;
  for (const InternalVariables& memory : internal_)
    if (memory.force->internal_depends_on_particles() &&
        std::ranges::count(prepared_, memory.force) == 0)
      prepared_.push_back(memory.force);
}

void Particles::add_internal(Force& force) {
  if (force.internal_size() == 0) return;
  constexpr std::size_t kLine = 8;
  const auto size = static_cast<std::size_t>(force.internal_size());
  internal_.push_back({&force, internal_size_, size});
  internal_follows_particles_ =
      internal_follows_particles_ || force.internal_depends_on_particles();
  internal_size_ += (size + kLine - 1) / kLine * kLine;
}

void Particles::add(Force& force, std::vector<const Net*>& nets) {
  on_.push_back(&force);
  if (const auto affine = force.affine()) {
    for (int axis = 0; axis < 3; ++axis) motion_.gravity[axis] += affine->acceleration[axis];
    motion_.damping += affine->damping;
  }
  if (const Springs* springs = force.springs()) {
    for (const SpringRun& run : springs->runs()) {
      runs_.push_back(&run);
      reach_ = std::max(reach_, whole_reach(run.stride));
    }
    if (!springs->net().empty()) nets.push_back(&springs->net());
    has_dashpots_ = has_dashpots_ || force.accumulates();
  }
  if (!force.accumulates()) return;
  other_forces_.push_back(&force);
  needs_velocities_ = needs_velocities_ || force.depends_on_velocity();
}

// A splitting kick applies drag to pinned particles too, unless each particle has an inverse mass
// of its own (0 for a pinned one).
void Particles::set_masses(const std::vector<double>& masses, const std::vector<int>& pinned,
                           bool some_move) {
  SIM_ASSERT(masses.size() == mass_.size());
  SIM_ASSERT(std::ranges::all_of(masses, [](double mass) { return mass > 0; }));
  std::ranges::copy(masses, mass_.begin());
  for (const int i : pinned) {
    SIM_ASSERT(0 <= i && i < layout_.n());
    mass_[static_cast<std::size_t>(i)] = std::numeric_limits<double>::infinity();
  }

  // Free particles of equal mass share one constant; otherwise each particle has its own inverse
  // mass.
  const std::size_t n = mass_.size();
  free_.assign(n / 8 + 2, 0);
  pinned_count_ = 0;
  motion_.inverse_mass = 0;
  bool uniform = !some_move && prescribed_.empty();
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

ParticleView Particles::view(double t, const double* state) const {
  return {layout_.n(),
          t,
          layout_.block(state, 0),
          layout_.block(state, 1),
          layout_.block(state, 2),
          layout_.block(state, 3),
          layout_.block(state, 4),
          layout_.block(state, 5),
          mass_.data(),
          {state + layout_.size(), internal_size_}};
}

std::string Particles::name_of(const Force& force) const {
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (forces_[i].get() == &force)
      return force.springs() && force.accumulates() ? names_[i] + " with damping" : names_[i];
  return "of no name";
}

void Particles::add_collider(std::unique_ptr<Collider> collider, const std::string& name,
                             const double* x, int count) {
  contacts_.add(std::move(collider), name, view(0, x), count);
}

bool Particles::conserves_energy() const noexcept {
  return motion_.damping == 0 && other_forces_.empty() && contacts_.empty();
}

double Particles::kinetic_energy(double t, const double* state) const {
  const ParticleView p = view(t, state);
  return sum_over_tiles(p.n, [&](Tile tile) {
    return 0.5 * sum_in_lanes(tile.begin, tile.end, [&](int i) {
             return p.free_mass(i) * (p.vx[i] * p.vx[i] + p.vy[i] * p.vy[i] + p.vz[i] * p.vz[i]);
           });
  });
}

template <class Chosen>
double Particles::potential_of(double t, const double* state, Chosen chosen) const {
  const ParticleView p = view(t, state);
  double sum = 0;
  for (Force* const force : on_) {
    if (!chosen(*force)) continue;
    const ParticleView own = seen_by(*force, p);
    force->prepare(own, *pool_);
    sum += sum_over_tiles(p.n, [&](Tile tile) { return force->potential(own, tile); });
  }
  return sum;
}

double Particles::potential_energy(double t, const double* state) const {
  return potential_of(t, state, [](Force&) { return true; });
}

// Affine forces act on particles alone, and have energies that are large beside others.
double Particles::unbreakable_energy(double t, const double* state) const {
  return potential_of(t, state, [](Force& force) { return !force.breakable() && !force.affine(); });
}

double Particles::elastic_energy(double t, const double* state) const {
  const ParticleView p = view(t, state);
  double sum = 0;
  for (const Force* const force : on_)
    if (force->springs())
      sum += sum_over_tiles(p.n, [&](Tile tile) { return force->potential(p, tile); });
  return sum;
}

// The dissipated power, c sum |v|^2 of the drag less sum F.v over the dashpot forces F, of all
// particles. Pinned particles have v = 0 unless the user drags them.
double Particles::damping_power(double t, const double* state, Array& sums) const {
  const ParticleView p = view(t, state);
  const double drag = motion_.damping * sum_in_lanes(0, p.n, [&](int i) {
                        return p.vx[i] * p.vx[i] + p.vy[i] * p.vy[i] + p.vz[i] * p.vz[i];
                      });
  if (!has_dashpots_) return drag;
  std::ranges::fill(sums.span(), 0.0);
  const auto [fx, fy, fz] = Layout(p.n, 3).axes(sums.data());
  const ForceSink sink{fx, fy, fz};
  for (Force* force : other_forces_) {
    if (!force->springs()) continue;
    force->prepare(p, *pool_);
    pool_->run_parts(p.n, 8, [&](int begin, int end) { force->accumulate(p, {begin, end}, sink); });
  }
  return drag - sum_in_lanes(0, p.n, [&](int i) {
           return sink.x[i] * p.vx[i] + sink.y[i] * p.vy[i] + sink.z[i] * p.vz[i];
         });
}

void Particles::start_internal(double* state) const {
  std::fill_n(state + layout_.size(), internal_size_, 0.0);
  for (const InternalVariables& memory : internal_)
    memory.force->start({state + layout_.size() + memory.begin, memory.size});
}

ParticleView Particles::seen_by(const Force& force, ParticleView view) const {
  const std::span<const double> all = view.internal;
  view.internal = {};
  for (const InternalVariables& memory : internal_)
    if (memory.force == &force) view.internal = all.subspan(memory.begin, memory.size);
  return view;
}

void Particles::derive(const ParticleView& view, double* rates) const {
  for (const InternalVariables& memory : internal_)
    memory.force->derive(seen_by(*memory.force, view), {rates + memory.begin, memory.size});
}

void Particles::prepare_gather(const ParticleView& view) {
  sums_->net_forces.prepare(view, *pool_);
  for (Force* force : prepared_) force->prepare(seen_by(*force, view), *pool_);
}

void Particles::gather(const ParticleView& view, Tile tile, ForceSink sink) const {
  const int end = (tile.end + 7) / 8 * 8;  // nets add to whole blocks
  for (double* values : {sink.x, sink.y, sink.z}) std::fill(values + tile.begin, values + end, 0.0);
  sums_->net_forces.add(view, tile, sink);
  for (const Force* force : other_forces_) force->accumulate(seen_by(*force, view), tile, sink);
}

void Particles::accelerate(const ParticleView& view, double* const a[3], bool drag) {
  // The other forces are gathered in the array that will hold the acceleration.
  RkStage<double> sweep{};
  const double* const q[3] = {view.x, view.y, view.z};
  const double* const v[3] = {view.vx, view.vy, view.vz};
  for (int axis = 0; axis < 3; ++axis) {
    sweep.q[axis] = q[axis];
    sweep.v0[axis] = v[axis];
    sweep.a[axis] = a[axis];
    if (has_other_forces()) sweep.force[axis] = a[axis];
  }
  Motion motion = motion_;
  if (!drag) motion.damping = 0;
  prepare_gather(view);
  pool_->run([&](int rank) {
    const Part part = part_of(layout_.n(), 8, rank, pool_->size());
    Rings<double>& rings = sums_->rings[static_cast<std::size_t>(rank)];
    sums_->kernels.start(rings, pool_->size(), q, part.begin, reach_);
    for (int begin = part.begin; begin < part.end; begin += kGatherTile) {
      const Tile tile{begin, std::min(begin + kGatherTile, part.end)};
      if (has_other_forces()) gather(view, tile, {a[0], a[1], a[2]});
      sums_->kernels.rk(rings, motion, sweep, tile.begin, tile.end);
    }
  });
}

}  // namespace sim
