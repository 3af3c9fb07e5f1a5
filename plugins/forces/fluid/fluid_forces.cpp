#include "fluid_forces.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/math/elementary.h"

namespace sim {
namespace {

constexpr double kTooDense = 4;  // times the density at rest, at the start
constexpr double kFall = 9.81;   // m/s^2, for the speed of sound

[[noreturn]] void refuse(const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"force 'fluid'", "", why, remedy});
}

}  // namespace

double fluid_spacing(double volume, int dimensions) { return power(volume, 1.0 / dimensions); }

// Friction: for v = (y^2, 0, 0) sum_j (1 - q/2)^3 x^2 y^2/(r^2 + h^2/100) is to be 2 V, where x^2
// y^2 is r^4/(d (d + 2)) in the mean.
void fit_to_lattice(FluidLaw& law) {
  const double spacing = fluid_spacing(law.volume, law.dimensions), a = spacing / law.smoothing;
  const int most = static_cast<int>(2 / a) + 1, deep = law.dimensions == 3 ? most : 0;
  double density = 0, shear = 0;
  for (int i = -most; i <= most; ++i)
    for (int j = -most; j <= most; ++j)
      for (int k = -deep; k <= deep; ++k) {
        const double qq = a * a * (i * i + j * j + k * k), q = std::sqrt(qq), u = 1 - 0.5 * q;
        if (u <= 0) continue;
        density += u * u * (u * u) * (2 * q + 1);
        shear += u * u * u * qq * qq / (qq + 0.01);
      }
  law.scale = 1 / density;
  law.friction = 2 * law.volume * law.dimensions * (law.dimensions + 2) /
                 (shear * law.smoothing * law.smoothing);
}

// With r = 2 h (1 - u): int r^3 (u^3 - 9/8 u^4) dr = 16 h^4 (B(4, 4) - 9/8 B(5, 4)) = 16 h^4 / 320,
// int r^2 (u^3 - 9/8 u^4) dr = 8 h^3 (B(4, 3) - 9/8 B(5, 3)) = 8 h^3 / 168.
double fluid_cohesion(const FluidLaw& law, double tension) {
  const double h = law.smoothing, vv = law.volume * law.volume;
  constexpr double kPi = 3.14159265358979323846;
  return law.dimensions == 3 ? tension * vv * 40 / (kPi * h * h * h * h)
                             : tension * vv * 21 / (h * h * h);
}

void FluidForces::bind(const ParticleView& initial) {
  if (std::ssize(ids_) == initial.n) ids_.clear();
  if (!ids_.empty()) {
    index_.assign(static_cast<std::size_t>(initial.n), -1);
    for (std::size_t k = 0; k < ids_.size(); ++k)
      index_[static_cast<std::size_t>(ids_[k])] = static_cast<int>(k);
    own_ = Array(3 * (ids_.size() + 16));
  }
  double mass = 0;
  int count = 0;
  Vec3 low(HUGE_VAL, HUGE_VAL, HUGE_VAL), high = -low;
  for (int i = 0; i < initial.n; ++i) {
    if (index(i) < 0) continue;
    low = low.cwiseMin(initial.position(i));
    high = high.cwiseMax(initial.position(i));
    if (!initial.free(i)) continue;
    mass += initial.mass[i];
    ++count;
  }
  if (count == 0) refuse("none of its particles is free", "leave one without a pin");
  law_.volume = mass / count / given_.density;
  const double spacing = fluid_spacing(law_.volume, law_.dimensions);
  law_.smoothing = given_.smoothing > 0 ? given_.smoothing : 1.5 * spacing;
  if (!(law_.smoothing > 0.6 * spacing && law_.smoothing < 10 * spacing))
    refuse("smoothing is " + brief(law_.smoothing / spacing, 3) +
               " times the distance of its particles at rest",
           "give about 1.5 * (mass/density)^(1/" + std::to_string(law_.dimensions) + "), here " +
               brief(1.5 * spacing, 3) + " m");
  fit_to_lattice(law_);
  const Vec3 size = high - low;
  const double extent = std::max({size[0], size[1], size[2], spacing});
  const double sound = given_.sound > 0 ? given_.sound : 10 * std::sqrt(2 * kFall * extent);
  law_.stiffness = given_.compressible ? given_.density * sound * sound / 7 : 0;
  law_.viscosity = given_.viscosity + given_.density * given_.alpha * law_.smoothing * sound /
                                          (2 * (law_.dimensions + 2));
  law_.cohesion = fluid_cohesion(law_, given_.tension);
  kernels_ = fluid_kernels(law_);
  neighbours_.emplace(2 * law_.smoothing, kFluidSkin * law_.smoothing);
  mirrors_.bind(initial, spacing);
  if (!boundary_.empty()) {
    boundary_.bind(law_, initial);
    for (int i = 0; i < initial.n; ++i) {
      if (index(i) < 0) continue;
      if (boundary_.has(i))
        refuse("particle " + std::to_string(i) + " is of the fluid and of its solid",
               "name those of the fluid: particles = { ids }");
      if (const int body = boundary_.body_around(initial.position(i), initial); body >= 0)
        refuse("particle " + std::to_string(i) + " starts inside number " + std::to_string(body) +
                   " of its bodies, counted from 0",
               "leave it out, or move one of them");
    }
  }

  // Checks here already that the neighbour lists fit into memory.
  ThreadPool alone(1);
  prepare(initial, alone);
  double sum = 0;
  for (int i = 0; i < initial.n; ++i) sum += density(i);
  const auto places = static_cast<double>(ids_.empty() ? initial.n : std::ssize(ids_));
  if (sum > kTooDense * places)
    refuse("at the start it is " + brief(sum / places, 3) + " times as dense as at rest",
           "give particles the mass density * spacing^" + std::to_string(law_.dimensions) +
               ", or set them further apart");
}

// The view of the fluid's own particles, from which neighbour lists are made.
ParticleView FluidForces::own(const ParticleView& view, ThreadPool* pool) {
  if (ids_.empty()) return view;
  const auto n = static_cast<int>(ids_.size());
  double* const x = own_.data();
  double* const y = x + n + 16;
  double* const z = y + n + 16;
  pool->run_parts(n, 8, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int i = ids_[static_cast<std::size_t>(k)];
      x[k] = view.x[i];
      y[k] = view.y[i];
      z[k] = view.z[i];
    }
  });
  ParticleView result = view;
  result.n = n;
  result.x = x;
  result.y = y;
  result.z = z;
  return result;
}

void FluidForces::prepare(const ParticleView& view, ThreadPool& pool) {
  const bool first = densities_.size() == 0;
  const bool met = !boundary_.empty() && boundary_.update(view);
  const bool moved = neighbours_->update(own(view, &pool), pool) || first || met ||
                     (mirrors_.move() && view.t != t_);
  t_ = view.t;
  const std::span<const NeighbourBlock> blocks = neighbours_->blocks();
  const int count = static_cast<int>(blocks.size());
  const int places = ids_.empty() ? view.n : static_cast<int>(ids_.size());
  if (first) {
    const std::size_t size = 32 * blocks.size();
    for (Array* const array : {&points_, &velocities_, &pressure_, &viscosity_})
      *array = Array(size);
    densities_ = Array(8 * blocks.size());
    energies_ = Array(8 * blocks.size());
    if (law_.cohesion > 0) ties_ = Array(8 * blocks.size());
    mirrors_.reserve(blocks.size());
  }
  FluidBlocks seen{blocks.data(), neighbours_->points(), velocities_.data(), mirrors_.near(), {}};
  for (int wall = 0; wall < mirrors_.count(); ++wall) seen.walls[wall] = mirrors_.seen(wall);
  const auto each_part = [&](const auto& act) {
    pool.run_parts(8 * count, 8, [&](int begin, int end) { act(begin / 8, end / 8); });
  };
  const auto point_at = [&](std::ptrdiff_t p) {
    const double* const x = neighbours_->points() + 4 * p;
    return Vec3(x[0], x[1], x[2]);
  };
  const bool braking = viscous() && view.vx;
  const auto look_at_velocities = [&](int begin, int end) {
    bool changed = false;
    for (int p = 8 * begin; p < std::min(8 * end, places); ++p) {
      const int k = neighbours_->id(p), i = ids_.empty() ? k : ids_[static_cast<std::size_t>(k)];
      double* const v = velocities_.data() + 4 * static_cast<std::ptrdiff_t>(p);
      const double now[3] = {view.vx[i], view.vy[i], view.vz[i]};
      for (int axis = 0; axis < 3; ++axis) {
        changed |= now[axis] != v[axis];
        v[axis] = now[axis];
      }
    }
    return changed;
  };
  if (!moved && !braking) return;
  if (moved && mirrors_.count() > 0) {
    mirrors_.look(view.t);
    each_part([&](int begin, int end) {
      mirrors_.find(view.t, neighbours_->points(), places, kFluidSeen * law_.smoothing, begin, end);
    });
  }
  if (moved) make_weights();
  seen.planes = mirrors_.planes();
  seen.ties = ties_.data();
  seen.weights = weights_.data();
  seen.firsts = firsts_.data();
  if (!moved) {
    std::atomic<bool> changed{!viscosity_known_};
    each_part([&](int begin, int end) {
      if (look_at_velocities(begin, end)) changed.store(true, std::memory_order_relaxed);
    });
    if (changed)
      each_part([&](int begin, int end) {
        kernels_.resistance(law_, seen, begin, end, viscosity_.data());
      });
    viscosity_known_ = true;
    return;
  }
  each_part([&](int begin, int end) {
    kernels_.densities(law_, seen, begin, end, densities_.data());
    for (std::ptrdiff_t p = 8 * begin; p < 8 * end; ++p) {
      if (!boundary_.empty() && p < places) densities_.data()[p] += boundary_.density(point_at(p));
      const double n = densities_.data()[p];
      std::copy_n(neighbours_->points() + 4 * p, 3, points_.data() + 4 * p);
      points_.data()[4 * p + 3] = fluid_pressure(law_, n) / (n * n);
      energies_.data()[p] =
          law_.volume * fluid_energy(law_, n) + (ties_.size() > 0 ? ties_.data()[p] : 0);
    }
    if (braking) look_at_velocities(begin, end);
  });
  seen.points = points_.data();
  each_part([&](int begin, int end) {
    kernels_.forces(law_, seen, begin, end, pressure_.data(),
                    braking ? viscosity_.data() : nullptr);
  });
  viscosity_known_ = braking;
  if (!boundary_.empty()) add_boundary_pressure(places);
}

// In the order of ids, so that sums do not depend on the places in the lists.
void FluidForces::add_boundary_pressure(int places) {
  boundary_.begin_forces();
  for (int k = 0; k < places; ++k) {
    const auto at = 4 * static_cast<std::ptrdiff_t>(neighbours_->place(k));
    const double* const x = points_.data() + at;
    const Vec3 force = boundary_.push({x[0], x[1], x[2]}, x[3]);
    for (int axis = 0; axis < 3; ++axis)
      pressure_.data()[at + axis] += force[static_cast<std::size_t>(axis)];
  }
}

// One weight for each entry of the lists and for each of its images: in each wall near the block,
// in each two and each three of them; and for those of the place itself.
void FluidForces::make_weights() {
  std::size_t count = 0;
  firsts_.clear();
  for (std::size_t b = 0; b < neighbours_->blocks().size(); ++b) {
    firsts_.push_back(count);
    const auto length = static_cast<std::size_t>(neighbours_->blocks()[b].length);
    const auto walls = static_cast<std::size_t>(std::popcount(mirrors_.near()[b]));
    count += 8 * (length + (length + 1) * (walls * walls * walls + 5 * walls) / 6);
  }
  if (count > weights_.size()) weights_ = Array(count + count / 8);
}

void FluidForces::add(const Array& forces, Tile tile, ForceSink sink) const {
  for (int i = tile.begin; i < tile.end; ++i) {
    const int k = index(i);
    if (k < 0) continue;
    const double* const force = forces.data() + 4 * std::ptrdiff_t{neighbours_->place(k)};
    sink.x[i] += force[0];
    sink.y[i] += force[1];
    sink.z[i] += force[2];
  }
}

double FluidForces::potential(Tile tile) const {
  double sum = 0;
  for (int i = tile.begin; i < tile.end; ++i)
    if (const int k = index(i); k >= 0)
      sum += energies_[static_cast<std::size_t>(neighbours_->place(k))];
  return sum;
}

std::vector<int> FluidForces::uncoupled_particles() const {
  std::vector<int> ids;
  for (int i = 0; i < static_cast<int>(index_.size()); ++i)
    if (index(i) < 0 && !boundary_.has(i)) ids.push_back(i);
  return ids;
}

double FluidForces::density(int id) const {
  const int k = index(id);
  return k < 0 ? 0 : densities_[static_cast<std::size_t>(neighbours_->place(k))];
}

}  // namespace sim
