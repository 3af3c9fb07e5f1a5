#include "fluid_correction.h"

#include <algorithm>

namespace sim {

std::span<double> FluidCorrection::pressures(double* state) const {
  for (const InternalVariables& memory : particles_->internal_variables())
    if (memory.force == fluid_)
      return {state + particles_->layout().size() + memory.begin, memory.size};
  return {};
}

// All energy that a step changes counts as taken, including the work of walls that put particles
// back.
StepCorrection::Outcome FluidCorrection::apply(const Step& step) {
  if (std::ranges::count(particles_->forces(), fluid_) == 0) return Outcome::kUnchanged;
  const double end = step.t + step.h;
  const auto energy = [&] {
    return particles_->kinetic_energy(end, step.x_next) +
           particles_->potential_energy(end, step.x_next);
  };
  const ParticleView view = particles_->view(end, step.x_next);
  const auto q = particles_->layout().axes(step.x_next);
  const auto v = particles_->layout().axes(step.x_next, 3);
  const double before = energy();
  if (!projection_->project({view, step.h, q.data(), v.data(), pressures(step.x_next)},
                            particles_->pool()))
    return Outcome::kUnchanged;
  if (particles_->pool().gives_up(0)) return Outcome::kUnchanged;
  const Contacts& contacts = particles_->contacts();
  for (int i = 0; !contacts.empty() && i < view.n; ++i) {
    if (!projection_->leads(i) || !view.free(i)) continue;
    Vec3 place = view.position(i);
    contacts.push_out(end, place);
    for (std::size_t axis = 0; axis < 3; ++axis) q[axis][i] = place[axis];
  }
  work_ += before - energy();
  return Outcome::kChanged;
}

}  // namespace sim
