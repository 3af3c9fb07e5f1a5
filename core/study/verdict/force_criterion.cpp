// Forces with a potential: F = -dU/dx at the start, by differences.
#include <algorithm>
#include <cmath>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/base/noise.h"
#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr double kWrongForce = 1e-3;  // of F and dU/dx
constexpr double kSmall = 2000;       // particles, where a look costs nothing to speak of
constexpr double kAffordable = 600;   // evaluations of a run, of which a look is 0.5 %
constexpr double kRounds = 1e-12;     // of U

// One force near the initial state: its value, and the slope of its potential.
class ForceSlope {
 public:
  ForceSlope(const ParticleSystem& system, Force& force, double t, std::span<const double> x)
      : system_(system), force_(force), t_(t), x_(x.size()), moved_(x.size()) {
    std::ranges::copy(x, x_.data());
    std::ranges::copy(x, moved_.data());
  }

  int n() const { return system_.layout().n(); }
  bool free(int i) const { return system_.masses()[static_cast<std::size_t>(i)] < HUGE_VAL; }

  // Displaces the particles slightly from the scene's state, in which forces may be zero by
  // symmetry.
  void displace(double length) {
    Noise noise;
    each_free([&](int i, int axis) { at(x_, i, axis) += length * noise.next(); });
    std::ranges::copy(x_.span(), moved_.data());
    const auto size = static_cast<std::size_t>(n());
    f_ = Array(3 * size);
    const ParticleView view = seen();
    force_.prepare(view, system_.pool());
    const ForceSink sink{f_.data(), f_.data() + size, f_.data() + 2 * size};
    force_.accumulate(view, {0, view.n}, sink);
    if (!force_.has_dissipative_part()) return;
    Array friction(3 * size);
    force_.dissipative_part(view, {0, view.n},
                            {friction.data(), friction.data() + size, friction.data() + 2 * size});
    for (std::size_t k = 0; k < f_.size(); ++k) f_[k] -= friction[k];
  }

  double force(int i, int axis) const { return f_[static_cast<std::size_t>(axis * n() + i)]; }

  // (U(x + h d) - U(x - h d)) / 2h, and its rounding error.
  template <class Direction>
  double slope(double h, Direction d) {
    double ends[2];
    for (const int side : {0, 1}) {
      each_free([&](int i, int axis) {
        at(moved_, i, axis) = at(x_, i, axis) + (side == 0 ? -h : h) * d(i, axis);
      });
      const ParticleView view = seen();
      force_.prepare(view, system_.pool());
      ends[side] = force_.potential(view, {0, view.n});
    }
    noise_ = kRounds * (std::abs(ends[0]) + std::abs(ends[1])) / h;
    return (ends[1] - ends[0]) / (2 * h);
  }
  double noise() const { return noise_; }

  template <class F>
  void each_free(F f) {
    for (int i = 0; i < n(); ++i)
      for (int axis = 0; free(i) && axis < 3; ++axis) f(i, axis);
  }

 private:
  double& at(Array& state, int i, int axis) {
    return system_.layout().block(state.data(), axis)[i];
  }
  ParticleView seen() const { return system_.seen_by(force_, system_.view(t_, moved_.data())); }

  const ParticleSystem& system_;
  Force& force_;
  double t_;  // s
  Array x_, moved_, f_;
  double noise_ = 0;  // N
};

// True if the potential misses the force by the same amount in steps of h, h/10 and h/100, along a
// direction in which every particle moves: rounding errors and kinks do not.
bool misses(ForceSlope& slope, double h) {
  double before = 0;
  for (const double step : {h, h / 10, h / 100}) {
    Noise noise;
    double along = 0;
    std::vector<double> d(3 * static_cast<std::size_t>(slope.n()));
    slope.each_free([&](int i, int axis) {
      along += slope.force(i, axis) * (d[static_cast<std::size_t>(3 * i + axis)] = noise.next());
    });
    const double rise = slope.slope(
        step, [&](int i, int axis) { return d[static_cast<std::size_t>(3 * i + axis)]; });
    const double missing = rise + along, size = std::abs(rise) + std::abs(along);
    if (!(std::abs(missing) > kWrongForce * size + slope.noise())) return false;
    if (step < h && !(std::abs(missing - before) < 0.05 * std::abs(missing))) return false;
    before = missing;
  }
  return true;
}

std::string newtons(const Vec3& f) {
  return "(" + brief(f[0], 3) + ", " + brief(f[1], 3) + ", " + brief(f[2], 3) + ") N";
}

// The example is the particle, of those with the largest forces, with the largest difference.
std::string example_of(ForceSlope& slope, double h) {
  constexpr int kLooked = 4;
  std::vector<int> ids;
  const auto size = [&](int i) {
    return std::hypot(slope.force(i, 0), slope.force(i, 1), slope.force(i, 2));
  };
  for (int i = 0; i < slope.n(); ++i)
    if (slope.free(i)) ids.push_back(i);
  const auto middle = ids.begin() + std::min<std::ptrdiff_t>(kLooked, std::ssize(ids));
  std::ranges::partial_sort(ids, middle, std::greater{}, size);
  double worst = -1;
  std::string text;
  for (auto id = ids.begin(); id != middle; ++id) {
    const int i = *id;
    Vec3 force, from_potential;
    for (int axis = 0; axis < 3; ++axis) {
      force[axis] = slope.force(i, axis);
      from_potential[axis] =
          -slope.slope(h, [&](int j, int k) { return j == i && k == axis ? 1.0 : 0.0; });
    }
    const double apart = (force - from_potential).norm();
    if (apart <= worst) continue;
    worst = apart;
    text = ": on particle " + std::to_string(i) + " it is " + newtons(force) + ", -dU/dx is " +
           newtons(from_potential);
  }
  return text;
}

class ForceCriterion final : public Criterion {
 public:
  explicit ForceCriterion(const Watched& run) {
    Simulation& system = run.system;
    const ParticleSystem& particles = *particles_of(system);
    const double n = std::max(1, system.particles());
    const double spacing = scene_size(system) / std::cbrt(n);
    for (Force* force : particles.other_forces()) {
      if (!(force->conservative() || force->has_dissipative_part()) || force->springs()) continue;
      try {
        ForceSlope slope(particles, *force, system.t(), system.state());
        slope.displace(1e-3 * spacing);
        if (misses(slope, 1e-4 * spacing))
          words_ += (words_.empty() ? "" : "; ") + ("force '" + particles.name_of(*force)) +
                    "' is not what its potential gives" + example_of(slope, 1e-5 * spacing);
      } catch (const Error&) {  // a function of the scene that the place near the start is not for
      }
    }
  }

  void look(const Energy* /*energy*/) override {}

  void conclude(Figures& /*figures*/, std::vector<Finding>& findings) override {
    if (!words_.empty()) findings.push_back({Trust::kSuspect, words_});
  }

 private:
  std::string words_;
};

}  // namespace

std::unique_ptr<Criterion> watch_forces(const Watched& run) {
  const Simulation& system = run.system;
  if (!run.registry || !system.second_order() || system.step_count() > 0) return nullptr;
  const ParticleSystem& particles = *particles_of(run.system);
  if (particles.other_forces().empty()) return nullptr;
  const double evaluations =
      static_cast<double>(run.steps) * std::max(1, system.integrator_info().evaluations);
  if (system.particles() > kSmall && evaluations < kAffordable) return nullptr;
  return std::make_unique<ForceCriterion>(run);
}

}  // namespace sim::study
