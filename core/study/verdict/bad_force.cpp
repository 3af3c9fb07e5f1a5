#include "core/study/verdict/bad_force.h"

#include <algorithm>
#include <cmath>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/particles/particle_system.h"

namespace sim::study {
namespace {

constexpr double kHuge = 1e100;  // m, m/s: beyond it any power of a coordinate may overflow

// The first free particle on which a force is not finite; -1 for none.
int bad_particle(Force& force, const ParticleView& view, ThreadPool& pool) {
  const auto n = static_cast<std::size_t>(view.n);
  Array sums(3 * n);
  const ForceSink sink{sums.data(), sums.data() + n, sums.data() + 2 * n};
  try {
    force.prepare(view, pool);
    force.accumulate(view, {0, view.n}, sink);
  } catch (const Error&) {  // a function of the scene, which has said so before
    return -1;
  }
  for (int i = 0; i < view.n; ++i)
    if (view.free(i) && !std::isfinite(sink.x[i] + sink.y[i] + sink.z[i])) return i;
  return -1;
}

}  // namespace

std::optional<BadForce> find_bad_force(const SystemSpec& spec, Simulation& system) {
  auto* const particles = dynamic_cast<ParticleSystem*>(&system.ode());
  if (!particles || particles->other_forces().empty()) return {};
  if (std::ranges::any_of(system.state(), [](double x) { return std::abs(x) > kHuge; })) return {};
  const std::size_t size = particles->size();
  Array here(size), rate(size), there(size);
  try {
    particles->eval(system.t(), {system.state().data(), {}}, here.data(), rate.data());
  } catch (const Error&) {
    return {};
  }
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const Stage::Term term{share * system.h(), rate.data()};
    particles->combine({system.state().data(), {&term, share > 0 ? 1u : 0u}}, there.data());
    const ParticleView view = particles->view(system.t() + share * system.h(), there.data());
    for (std::size_t i = 0; i < particles->forces().size(); ++i) {
      Force& force = *particles->forces()[i];
      if (!std::ranges::count(particles->other_forces(), &force)) continue;
      const int at = bad_particle(force, particles->seen_by(force, view), particles->pool());
      if (at < 0) continue;
      const std::string place = i < spec.forces.size() ? spec.forces[i].place : "";
      return BadForce{particles->name_of(force), place, at};
    }
  }
  return {};
}

}  // namespace sim::study
