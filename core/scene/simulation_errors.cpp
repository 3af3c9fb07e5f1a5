// Attribution of failures: a method that does not fit, a step that fails, an exception of a plugin.
#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/base/thrown.h"
#include "core/base/utf8.h"
#include "core/scene/plugin_guard.h"
#include "core/scene/simulation_impl.h"

namespace sim {

// Names of springs appear in tables and reports.
void check_family(const std::string& name, const SourceLocation& place) {
  if (visible_line(name) != name)
    throw Error(ErrorKind::kScene,
                {"bad family '" + visible_line(name) + "'", place,
                 "a name is one line without control characters", "write it in plain text"});
}

// A method that does not fit is reported at the line of the force that it cannot take, if any.
Error Simulation::Impl::blaming_force(const Error& misfit, const SourceLocation& scene) const {
  ErrorText text = misfit.text();
  if (!text.where.empty()) return misfit;
  text.where = scene;
  if (!particles) return Error(misfit.kind(), text);
  const bool splits = text.why.starts_with("a splitting method");
  for (std::size_t i = 0; i < force_places.size(); ++i) {
    const Force& force = *particles->forces()[i];
    if (!std::ranges::count(particles->other_forces(), &force)) continue;
    const std::string quoted = "'" + particles->name_of(force) + "'";
    const bool named = text.why.find("force " + quoted) != std::string::npos ||
                       text.why.find("force, " + quoted) != std::string::npos;
    if (!named && !(splits && (force.depends_on_velocity() || force.internal_size() > 0))) continue;
    text.where = force_places[i];
    if (!named) text.why = "force " + quoted + " does not suit it: " + text.why;
    break;
  }
  return Error(misfit.kind(), text);
}

bool Simulation::Impl::find_divergence(StepStatus status) {
  Divergence found{status, -1, step_count + 1, t(step_count + 1), settings->h, "", "", ""};
  bool finite = status == StepStatus::kNotFinite;
  if (finite)
    shape.each([&](const StateNumber& number) {
      finite = std::isfinite(x_next[number.at]);
      if (finite) return true;
      found.particle = static_cast<int>(number.item);
      found.quantity = number.name();
      found.item = number.part->item;
      return false;
    });
  if (finite || status == StepStatus::kNotAllowed) found.why = system->refusal();
  if (finite && !found.why.empty()) {
    found.status = StepStatus::kNotAllowed;
    finite = false;
  }
  if (!finite) divergence = found;
  return !finite;
}

// The force that failed is found by evaluating each at the state before; else it was the method.
void Simulation::Impl::rethrow_in_step(double h) {
  thrown_by_others();  // errors that name their source need no search
  const double begin = t(step_count);
  const std::string what =
      "in step " + std::to_string(step_count + 1) + " from t = " + shortest(begin) + " s";
  if (!particles)
    rethrow_from_plugin("integrator '" + settings->method.name() + "' or field", "", what);
  const auto n = static_cast<std::size_t>(initial.count());
  Array sums(3 * n);
  for (const double at : {begin, begin + 0.5 * h, begin + h})
    for (Force* const force : particles->other_forces()) {
      const ParticleView view = particles->seen_by(*force, particles->view(at, x.data()));
      try {
        force->prepare(view, *pool);
        force->accumulate(view, {0, view.n}, {sums.data(), sums.data() + n, sums.data() + 2 * n});
      } catch (...) {
        rethrow_from_plugin("force '" + particles->name_of(*force) + "'", "", what);
      }
    }
  const bool alone = particles->other_forces().empty();
  rethrow_from_plugin("integrator '" + settings->method.name() + (alone ? "'" : "' or a force"), "",
                      what);
}

}  // namespace sim
