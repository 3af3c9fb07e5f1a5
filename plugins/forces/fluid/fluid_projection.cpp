#include "fluid_projection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/text.h"
#include "core/math/elementary.h"

namespace sim {
namespace {

constexpr int kMostMoves = 10;     // of places, a step
constexpr double kSingle = 10;     // the error allowed to a single particle, over the mean
constexpr double kFirmly = 0.3;    // of the error: how well places are solved for
constexpr double kQuietly = 0.1;   // of the velocity error, as pressures are warm-started
constexpr double kViscous = 1e-3;  // of the change by viscosity
constexpr int kMostBrakes = 200;   // products with K, a step

// The largest eigenvalue of J J' in a lattice: of waves along an axis it is |sum of s sin(k x)|^2.
double largest_eigenvalue(const FluidLaw& law) {
  const double hh = law.smoothing * law.smoothing;
  const double a = fluid_spacing(law.volume, law.dimensions);
  const int most = static_cast<int>(2 * law.smoothing / a) + 1;
  const int deep = law.dimensions == 3 ? most : 0;
  double largest = 0;
  for (int wave = 1; wave < 32; ++wave) {
    double sum = 0;
    for (int i = -most; i <= most; ++i)
      for (int j = -most; j <= most; ++j)
        for (int k = -deep; k <= deep; ++k) {
          const double u = 1 - 0.5 * a * std::sqrt(i * i + j * j + k * k) / law.smoothing;
          if (u > 0)
            sum += 5 * law.scale / hh * u * u * u * a * i *
                   elementary::sin(std::numbers::pi / 32 * wave * i);
        }
    largest = std::max(largest, sum * sum);
  }
  return largest;
}

}  // namespace

void FluidProjection::bind(const FluidLaw& law, const ParticleView& initial) {
  law_ = law;
  if (std::ssize(ids_) == initial.n) ids_.clear();
  const auto n = ids_.empty() ? static_cast<std::size_t>(initial.n) : ids_.size();
  if (!ids_.empty()) own_ = Array(3 * (n + 16));
  mass_ = Array(n);
  wanted_ = Array(n);
  sum_ = OrderedSums(static_cast<int>(n));
  rows_.bind(law, initial);
  constexpr double kMore = 1.5;  // for denser regions
  solve_.bind(static_cast<int>(n), kMore * largest_eigenvalue(law));

  // Checks here already that the rows fit into memory.
  ThreadPool alone(1);
  rows_.make(own(initial), alone);
  displacements_ = Array(4 * static_cast<std::size_t>(rows_.places()));
  rates_ = Array(static_cast<std::size_t>(rows_.places()));
}

ParticleView FluidProjection::own(const ParticleView& view) {
  ParticleView result = view;
  result.n = ids_.empty() ? view.n : static_cast<int>(ids_.size());
  double* const x = own_.data();
  for (int k = 0; k < result.n; ++k) {
    const int i = ids_.empty() ? k : ids_[static_cast<std::size_t>(k)];
    mass_.data()[k] = view.mass[i];
    if (ids_.empty()) continue;
    x[k] = view.x[i];
    x[result.n + 16 + k] = view.y[i];
    x[2 * (result.n + 16) + k] = view.z[i];
  }
  if (ids_.empty()) return result;
  result.x = x;
  result.y = x + result.n + 16;
  result.z = x + 2 * (result.n + 16);
  return result;
}

// The density error of free particles; that of fixed ones cannot be corrected.
bool FluidProjection::meets_error() {
  const double* const density = rows_.densities();
  double sum = 0;
  int free = 0;
  worst_ = 0;
  for (int k = 0; k < count(); ++k) {
    if (!is_free(k)) continue;
    ++free;
    const double more = std::max(0.0, density[rows_.place(k)] - 1);
    sum += more;
    worst_ = std::max(worst_, more);
  }
  mean_ = sum / std::max(1, free);
  return mean_ <= error_ && worst_ <= kSingle * error_;
}

int FluidProjection::id_at(int place) const {
  const int k = rows_.id(place);
  return ids_.empty() ? k : ids_[static_cast<std::size_t>(k)];
}

void FluidProjection::load(const double* const* v) {
  for (int p = 0; p < count(); ++p)
    for (int axis = 0; axis < 3; ++axis) displacements_.data()[4 * p + axis] = v[axis][id_at(p)];
}

void FluidProjection::add(const double* changes, double* const* to) const {
  for (int p = 0; p < count(); ++p)
    for (int axis = 0; axis < 3; ++axis) to[axis][id_at(p)] += changes[4 * p + axis];
}

bool FluidProjection::correct_places(const End& end, ThreadPool& pool) {
  rows_.make(own(end.view), pool);
  bool moved = false;
  met_ = meets_error();
  for (int move = 0; !met_ && move < kMostMoves && !pool.gives_up(0); ++move) {
    for (int p = 0; p < count(); ++p)
      wanted_.data()[p] = is_free(rows_.id(p)) ? rows_.densities()[p] - 1 : 0;
    std::ranges::fill(solve_.pressures(rows_), 0.0);
    solve_.solve(rows_, wanted_.data(), mass_.data(), kFirmly * error_, pool);
    add(solve_.pressure_forces(), end.q);
    moved = true;
    rows_.make(own(end.view), pool);
    met_ = meets_error();
  }
  if (pool.gives_up(0)) return moved;
  counts_.mean = std::max(counts_.mean, mean_);
  counts_.worst = std::max(counts_.worst, worst_);
  return moved;
}

// Conjugate gradients, with M as a preconditioner, for the change of velocity: (M + h K) dv = -h K
// v.
bool FluidProjection::apply_viscosity(const End& end, ThreadPool& pool) {
  if (!(law_.viscosity > 0)) return false;
  if (changes_.size() == 0)
    for (Array* const array : {&changes_, &residual_, &direction_, &product_})
      *array = Array(displacements_.size());
  double* const dv = changes_.data();
  double* const r = residual_.data();
  double* const displacement = direction_.data();
  double* const product = product_.data();
  const auto each = [&](const auto& act) {
    pool.run_parts(count(), 8, [&](int begin, int end_of_part) {
      for (int p = begin; p < end_of_part; ++p) {
        const int k = rows_.id(p);
        const double inverse = is_free(k) ? 1 / mass_.data()[k] : 0;
        for (int axis = 0; axis < 3; ++axis) act(4 * p + axis, inverse);
      }
    });
  };
  const auto squares = [&](const double* a) {  // over the mass
    return sum_(rows_, pool, [&](int p) {
      const double* const x = a + 4 * p;
      return (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) / mass_.data()[rows_.id(p)];
    });
  };
  const auto dot = [&](const double* a, const double* b) {
    return sum_(rows_, pool, [&](int p) {
      return a[4 * p] * b[4 * p] + a[4 * p + 1] * b[4 * p + 1] + a[4 * p + 2] * b[4 * p + 2];
    });
  };
  load(end.v);
  rows_.apply_viscosity(displacements_.data(), product, pool);
  each([&](int c, double inverse) {
    r[c] = inverse > 0 ? -end.h * product[c] : 0;
    displacement[c] = inverse * r[c];
    dv[c] = 0;
  });
  double left = squares(r);
  if (left == 0) return false;
  const double enough = kViscous * kViscous * left;
  for (int turn = 0; turn < kMostBrakes && left > enough && !pool.gives_up(0); ++turn) {
    rows_.apply_viscosity(displacement, product, pool);
    each([&](int c, double inverse) {
      product[c] = inverse > 0 ? displacement[c] / inverse + end.h * product[c] : 0;
    });
    const double length = left / dot(displacement, product);
    each([&](int c, double) {
      dv[c] += length * displacement[c];
      r[c] -= length * product[c];
    });
    const double before = left;
    left = squares(r);
    each([&](int c, double inverse) {
      displacement[c] = inverse * r[c] + left / before * displacement[c];
    });
  }
  met_ = met_ && left <= enough;
  add(dv, end.v);
  return true;
}

// The pressures are warm-started from the last step: p V h is their scale in A.
bool FluidProjection::correct_velocities(const End& end, ThreadPool& pool) {
  double* const wanted = wanted_.data();
  load(end.v);
  rows_.rate(displacements_.data(), rates_.data(), pool);
  for (int p = 0; p < count(); ++p) {
    wanted[p] =
        rates_.data()[p] + rows_.wall_rates()[p] - std::max(0.0, 1 - rows_.densities()[p]) / end.h;
    if (!is_free(rows_.id(p))) wanted[p] = std::min(wanted[p], 0.0);
  }
  const double missing =
      sum_(rows_, pool, [&](int p) { return std::max(0.0, wanted[p]) * std::max(0.0, wanted[p]); });
  if (missing == 0) {
    std::ranges::fill(end.memory, 0.0);
    return false;
  }
  const double unit = law_.volume * end.h;
  const std::span<double> pressures = solve_.pressures(rows_);
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  for (int p = 0; p < count(); ++p) pressures[at(p)] = unit * end.memory[at(rows_.id(p))];
  met_ = solve_.solve(rows_, wanted, mass_.data(), kQuietly * std::sqrt(missing / count()), pool) &&
         met_;
  for (int p = 0; p < count(); ++p) end.memory[at(rows_.id(p))] = pressures[at(p)] / unit;
  add(solve_.pressure_forces(), end.v);
  return true;
}

bool FluidProjection::project(const End& end, ThreadPool& pool) {
  const long before = solve_.products();
  bool changed = correct_places(end, pool);
  changed = apply_viscosity(end, pool) || changed;
  changed = correct_velocities(end, pool) || changed;
  if (pool.gives_up(0)) return changed;
  ++counts_.steps;
  counts_.missed += !met_;
  counts_.products += solve_.products() - before;
  return changed;
}

void FluidProjection::forget() { counts_ = {}; }

StepCorrection::Account FluidProjection::account() const {
  if (counts_.steps == 0) return {};
  const double each = static_cast<double>(counts_.products) / static_cast<double>(counts_.steps);
  std::string words = "density of fluid to " + brief(100 * counts_.mean, 2) +
                      " % above rest, of a particle " + brief(100 * counts_.worst, 2) + " %, by " +
                      brief(each, 2) + " products a step";
  if (counts_.missed == 0) return {words, true};
  return {words + ", not solved for in " + std::to_string(counts_.missed) +
              (counts_.missed == 1 ? " step" : " steps"),
          false};
}

}  // namespace sim
