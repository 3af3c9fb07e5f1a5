#include "core/scene/divergence.h"

#include <algorithm>
#include <cmath>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/particles/particle_system.h"

namespace sim {
namespace {

constexpr double kHuge = 1e100;  // m, m/s: beyond it any power of a coordinate may overflow

// The first free particle on which a force is not finite; -1 for none.
int bad_particle(Force& force, const ParticleView& view, Team& team) {
  const auto n = static_cast<std::size_t>(view.n);
  Array sums(3 * n);
  const ForceSink sink{sums.data(), sums.data() + n, sums.data() + 2 * n};
  try {
    force.prepare(view, team);
    force.accumulate(view, {0, view.n}, sink);
  } catch (const Error&) {  // a function of the scene, which has said so before
    return -1;
  }
  for (int i = 0; i < view.n; ++i)
    if (view.free(i) && !std::isfinite(sink.x[i] + sink.y[i] + sink.z[i])) return i;
  return -1;
}

}  // namespace

void find_bad_force(ParticleSystem& system, double t, const double* x, Divergence& found) {
  if (system.other_forces().empty()) return;
  const std::size_t size = system.size();
  if (std::any_of(x, x + size, [](double value) { return std::abs(value) > kHuge; })) return;
  Array here(size), rate(size), there(size);
  system.eval(t, {x, {}}, here.data(), rate.data());
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const Stage::Term term{share * found.h, rate.data()};
    system.combine({x, {&term, share > 0 ? 1u : 0u}}, there.data());
    const ParticleView view = system.view(t + share * found.h, there.data());
    for (Force* force : system.other_forces()) {
      const int particle = bad_particle(*force, system.seen_by(*force, view), system.team());
      if (particle < 0) continue;
      const std::string place = system.place_of(*force);
      found.force = "'" + system.name_of(*force) + "'" + (place.empty() ? "" : " (" + place + ")");
      found.force_particle = particle;
      return;
    }
  }
}

}  // namespace sim
