#include "core/particles/explicit/reordering.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/assert.h"

namespace sim {
namespace {

// The springs of a force in another order, or the sum of all affine forces.
class Springy final : public Force {
 public:
  explicit Springy(const Springs& springs) : springs_(&springs) {}
  const Springs* springs() const override { return springs_; }

 private:
  const Springs* springs_;
};

class Affine final : public Force {
 public:
  explicit Affine(const AffineForce& force) : force_(force) {}
  std::optional<AffineForce> affine() const override { return force_; }

 private:
  AffineForce force_;
};

// Coordinates grouped into the numbered planes of a grid; coordinates closer than a millionth of
// their extent share a plane.
struct Planes {
  std::vector<int> of;
  int count = 0;
};

Planes planes_of(const double* x, int n) {
  constexpr double kRounding = 1e-6;
  std::vector<int> sorted(static_cast<std::size_t>(n));
  std::iota(sorted.begin(), sorted.end(), 0);
  std::sort(sorted.begin(), sorted.end(), [&](int a, int b) { return x[a] < x[b]; });
  Planes planes{std::vector<int>(sorted.size()), 1};
  const double apart = kRounding * (x[sorted.back()] - x[sorted.front()]);
  for (std::size_t p = 0; p < sorted.size(); ++p) {
    if (p > 0 && x[sorted[p]] - x[sorted[p - 1]] > apart) ++planes.count;
    planes.of[static_cast<std::size_t>(sorted[p])] = planes.count - 1;
  }
  return planes;
}

// The springs of all forces that are switched on.
std::vector<const Springs*> springs_of(const Particles& particles) {
  std::vector<const Springs*> all;
  for (const Force* force : particles.forces())
    if (force->springs()) all.push_back(force->springs());
  return all;
}

}  // namespace

std::vector<int> Reordering::rows_of(const ParticleView& view) {
  Planes planes[3] = {planes_of(view.x, view.n), planes_of(view.y, view.n),
                      planes_of(view.z, view.n)};
  // Sorting by the direction with the most planes first keeps the longest strides short.
  std::ranges::stable_sort(planes, std::greater(), &Planes::count);
  std::vector<int> order(static_cast<std::size_t>(view.n));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    for (const Planes& each : planes) {
      const int of_a = each.of[static_cast<std::size_t>(a)];
      const int of_b = each.of[static_cast<std::size_t>(b)];
      if (of_a != of_b) return of_a < of_b;
    }
    return a < b;
  });
  return order;
}

bool Reordering::fits(const Particles& particles) const { return given_ == springs_of(particles); }

Reordering::Reordering(const Particles& particles, const std::vector<int>& rows)
    : given_(springs_of(particles)), order_(rows) {
  constexpr double kMostly = 0.9;  // of all springs, that are in runs
  number_springs(particles);
  double all = 0, in_runs = 0;
  for (const Springs& springs : springs_) {
    all += static_cast<double>(springs.count());
    for (const SpringRun& run : springs.runs()) in_runs += run.count;
  }
  if (in_runs >= kMostly * all) return;
  for (const Net* net : particles.nets())
    if (net->reordered()) {
      std::copy_n(net->order.begin(), order_.size(), order_.begin());
      break;
    }
  number_springs(particles);
}

void Reordering::number_springs(const Particles& particles) {
  const int n = particles.layout().n();
  SIM_ASSERT(order_.size() == static_cast<std::size_t>(n));
  place_.resize(order_.size());
  for (int p = 0; p < n; ++p)
    place_[static_cast<std::size_t>(order_[static_cast<std::size_t>(p)])] = p;
  SIM_ASSERT(std::ranges::is_permutation(order_, place_));  // both number all particles
  springs_.clear();
  for (const Springs* given : given_)
    springs_.emplace_back(
        n,
        [&](const Springs::Visit& visit) {
          for (int p = 0; p < n; ++p)
            given->at(order_[static_cast<std::size_t>(p)], [&](int to, double k, double rest) {
              const int q = place_[static_cast<std::size_t>(to)];
              if (q > p) visit(p, q, k, rest);
            });
        },
        given->sense());
}

ReorderedStepper::ReorderedStepper(const Particles& particles,
                                   std::shared_ptr<const Reordering> numbering, const Make& make)
    : numbering_(std::move(numbering)) {
  const Layout& layout = particles.layout();
  for (Array& state : states_) state = Array(layout.size());
  std::vector<std::unique_ptr<Force>> forces;
  const Motion& motion = particles.motion();
  forces.push_back(std::make_unique<Affine>(
      AffineForce{{motion.gravity[0], motion.gravity[1], motion.gravity[2]}, motion.damping}));
  for (const Springs& springs : numbering_->springs())
    forces.push_back(std::make_unique<Springy>(springs));
  std::vector<double> masses;
  std::vector<int> fixed;
  for (const int i : numbering_->order()) {
    const double mass = particles.masses()[static_cast<std::size_t>(i)];
    if (std::isinf(mass)) fixed.push_back(static_cast<int>(masses.size()));
    masses.push_back(mass);
  }
  particles_ = std::make_unique<Particles>(masses, fixed, std::move(forces), states_[0].data(),
                                           particles.pool());
  // A pinned particle may be dragged by the user: then each particle has an inverse mass there.
  particles_->set_masses(masses, fixed, motion.inverse_masses != nullptr);
  stepper_ = make(*particles_);
}

void ReorderedStepper::restart() {
  last_ = nullptr;
  stepper_->restart();
}

namespace {

// Writes are sequential and reads scattered; the other way takes twice as long.
void copy_in_order(const Particles& particles, std::span<const int> from, const double* of,
                   double* to) {
  const Layout& layout = particles.layout();
  particles.pool().run_parts(layout.n(), 8, [&](int begin, int end) {
    for (int block = 0; block < 6; ++block) {
      const double* const source = layout.block(of, block);
      double* const target = layout.block(to, block);
      for (int i = begin; i < end; ++i) target[i] = source[from[static_cast<std::size_t>(i)]];
    }
  });
}

}  // namespace

bool ReorderedStepper::step(double t, double h, int count, const double* x, double* x_next) {
  SIM_ASSERT(count > 0 && x != x_next);
  double* const start = states_[now_].data();
  if (x != last_) copy_in_order(*particles_, numbering_->order(), x, start);
  now_ = 1 - now_;
  last_ = x_next;
  double* const end = states_[now_].data();
  const bool finite = stepper_->step(t, h, count, start, end);
  copy_in_order(*particles_, numbering_->place(), end, x_next);
  return finite;
}

}  // namespace sim
