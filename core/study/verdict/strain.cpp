#include "core/study/verdict/strain.h"

#include <cmath>

#include "core/particles/particle_system.h"
#include "core/particles/springs/near_points.h"

namespace sim::study {

namespace {

// Keeps the worst spring of all that it sees.
class Worst {
 public:
  explicit Worst(const ParticleView& view) : view_(view) {}

  double square(int a, int b) const {
    const double dx = view_.x[a] - view_.x[b], dy = view_.y[a] - view_.y[b],
                 dz = view_.z[a] - view_.z[b];
    return dx * dx + dy * dy + dz * dz;
  }

  void look(int a, int b, double rest) {
    if (!(rest > 0)) return;
    const double squared = square(a, b);
    const bool safe = squared > kSafeLeast && squared < kSafeMost;
    const double now = safe ? std::sqrt(squared) : length(view_.position(a) - view_.position(b));
    const double strain = now / rest - 1;
    if (worst_.a < 0 || !(std::abs(strain) <= std::abs(worst_.strain))) worst_ = {a, b, strain};
  }

  // For springs of one rest length the shortest and the longest suffice, without a root for the
  // others.
  void look(const SpringRun& run) {
    int shortest = -1, longest = -1;
    double least = HUGE_VAL, most = -1;
    for (int a = 0; a + run.stride < view_.n; ++a) {
      if (!run.owns(a)) continue;
      const double squared = square(a, a + run.stride);
      if (squared < least) {
        least = squared;
        shortest = a;
      }
      if (!(squared <= most)) {
        most = squared;
        longest = a;
      }
    }
    for (const int a : {shortest, longest})
      if (a >= 0) look(a, a + run.stride, run.rest);
  }

  const StrainedSpring& worst() const { return worst_; }

 private:
  const ParticleView& view_;
  StrainedSpring worst_;
};

// Calls visit(a, b, k, rest) for every spring.
template <class Visit>
void each_spring(const SpringRun& run, int n, Visit visit) {
  for (int a = 0; a + run.stride < n; ++a)
    if (run.owns(a)) visit(a, a + run.stride, run.k_of(a), run.rest_of(a));
}

template <class Visit>
void each_spring(const Net& net, int n, Visit visit) {
  if (net.empty()) return;
  for (int a = 0; a < n; ++a)
    net.at(a, [&](int b, double k, double rest) {
      if (a < b) visit(a, b, k, rest);
    });
}

}  // namespace

StrainedSpring worst_spring(Simulation& system) {
  const ParticleSystem* particles = particles_of(system);
  if (!particles) return {};
  const ParticleView view = particles->view(system.t(), system.state().data());
  Worst worst(view);
  for (const auto& force : particles->forces()) {
    const Springs* springs = force->springs();
    if (!springs) continue;
    const SpringSense sense = springs->sense();
    const auto look = [&](int a, int b, double /*k*/, double rest) {
      if (sense == SpringSense::kBoth || !slack(sense, worst.square(a, b), rest * rest))
        worst.look(a, b, rest);
    };
    for (const SpringRun& run : springs->runs())
      if (run.uniform)
        worst.look(run);
      else
        each_spring(run, view.n, look);
    each_spring(springs->net(), view.n, look);
  }
  return worst.worst();
}

// Near the point the force is k rest outwards, whatever the length. With the reduced mass m a
// motion passes over it if H = m v^2 / 2 + k ((r - rest)^2 - rest^2) / 2 > 0, and with an angular
// momentum l it approaches to (l^2 / (2 m k rest))^(1/3) if H = 0.
Pinch nearest_pinch(Simulation& system, double ahead) {
  Pinch nearest;
  const ParticleSystem* particles = particles_of(system);
  if (!particles) return nearest;
  const ParticleView p = particles->view(system.t(), system.state().data());
  const auto weight = [&](int i) { return p.free(i) ? 1 / p.mass[i] : 0.0; };
  const auto look = [&](int a, int b, double k, double rest) {
    if (!(rest > 0) || !(k > 0)) return;
    const Vec3 d = p.position(a) - p.position(b), v = p.velocity(a) - p.velocity(b);
    const double towards = -d.dot(v), fast = v.squaredNorm();
    const double s = towards <= 0 ? 0 : towards < ahead * fast ? towards / fast : ahead;
    const double share = (d + s * v).norm() / rest;
    if (share > Pinch::kNear) return;
    nearest.share = std::min(nearest.share, share);
    const double weights = weight(a) + weight(b);
    const bool passes = towards < ahead * fast || towards <= 0;
    if (weights == 0 || !passes) return;
    const double r = d.norm(), h = fast / (2 * weights) + 0.5 * k * r * (r - 2 * rest);
    const double turn = d.cross(v).squaredNorm() / (2 * weights * k * rest);
    const double margin = std::max(std::abs(h) / (k * rest), std::cbrt(turn));
    if (margin < nearest.margin) nearest = {a, b, nearest.share, margin};
  };
  for (const auto& force : particles->forces())
    if (const Springs* springs = force->springs();
        springs && springs->sense() != SpringSense::kTension)
      visit_near_points(*springs, p, ahead, Pinch::kNear, look);
  return nearest;
}

std::string family_of(const Simulation& system, int a, int b) {
  for (const Link& link : system.links(a))
    if (link.to == b) return link.family;
  return "";
}

}  // namespace sim::study
