#include "core/study/verdict/strain.h"

#include <cmath>

#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"

namespace sim::study {

namespace {

// Keeps the worst of what it is shown.
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

  // Of springs of one rest length the shortest and the longest are enough: no root for the others.
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

}  // namespace

StrainedSpring worst_spring(Simulation& system) {
  const ParticleSystem* particles = particles_of(system);
  if (!particles) return {};
  const ParticleView view = particles->view(system.t(), system.state().data());
  Worst worst(view);
  for (const auto& force : particles->forces()) {
    const Springs* springs = force->springs();
    if (!springs) continue;
    for (const SpringRun& run : springs->runs()) {
      if (run.uniform) {
        worst.look(run);
        continue;
      }
      for (int a = 0; a + run.stride < view.n; ++a)
        if (run.owns(a)) worst.look(a, a + run.stride, run.rest_of(a));
    }
    if (springs->net().empty()) continue;
    for (int a = 0; a < view.n; ++a)
      springs->net().at(a, [&](int b, double /*k*/, double rest) {
        if (a < b) worst.look(a, b, rest);
      });
  }
  return worst.worst();
}

std::string family_of(const Simulation& system, int a, int b) {
  for (const Link& link : system.links(a))
    if (link.to == b) return link.family;
  return "";
}

}  // namespace sim::study
