#include "core/study/problem.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/particles/particle_system.h"

namespace sim::study {
MethodChoice Problem::integrator() const { return options.integrator.over(spec->integrator); }

Problem Problem::with(const MethodChoice& integrator) const {
  Problem changed = *this;
  changed.options.integrator = integrator;
  return changed;
}

Simulation Problem::simulation(double dt) const {
  RunOptions run = options;
  if (dt > 0) run.dt = dt;
  return Simulation(*spec, *registry, run);
}

std::unique_ptr<Integrator> Problem::make_integrator() const {
  return Method(*registry, integrator(), spec->place).make();
}

std::vector<Candidate> fitting_methods(const Problem& problem,
                                       const std::vector<MethodChoice>& given) {
  std::vector<MethodChoice> wanted = given;
  if (wanted.empty())
    for (std::string& name : problem.registry->names<Integrator>())
      wanted.push_back({std::move(name)});
  const MethodChoice own = problem.integrator();
  const std::string own_name = problem.registry->get<Integrator>(own.name).name;
  std::vector<Candidate> methods;
  for (MethodChoice& choice : wanted) {
    try {
      const IntegratorPlugin& plugin =
          problem.registry->get<Integrator>(choice.name, "on the command line");
      const auto has = [&](auto what) {
        return std::any_of(plugin.params.begin(), plugin.params.end(), what);
      };
      if (given.empty() && plugin.name == own_name) choice.given = own.given;
      if (given.empty() && choice.given.empty() &&
          has([](const Param& param) { return param.required; }))
        continue;
      const Simulation simulation = problem.with(choice).simulation();
      const std::string label = simulation.method().label();
      if (std::ranges::count(methods, label, &Candidate::label))
        throw Error(ErrorKind::kUsage, {"'" + label + "' is listed twice", "on the command line",
                                        "one of them may be an alias", "keep one of them"});
      choice.name = plugin.name;
      methods.push_back({choice, label, simulation.integrator_info(),
                         has([](const Param& param) { return param.name == "tol"; }),
                         static_cast<bool>(plugin.make_from_others)});
      for (const Param& param : plugin.params)
        if (param.name == "tol") methods.back().least_tolerance = param.min;
    } catch (const Error& error) {
      if (given.empty()) continue;
      throw Error(ErrorKind::kUsage, error.text());
    }
  }
  return methods;
}

std::int64_t evaluations_of(const Simulation& system) {
  const std::int64_t counted = system.integrator().effort().evaluations;
  return counted > 0 ? counted : system.step_count() * system.integrator_info().evaluations;
}

const ParticleSystem* particles_of(Simulation& system) {
  return dynamic_cast<const ParticleSystem*>(&system.ode());
}

bool acts_between_steps(Simulation& system) {
  const ParticleSystem* const particles = particles_of(system);
  return (particles && !particles->contacts().empty()) || !system.corrections().empty() ||
         system.breaks();
}

StepMap::StepMap(OdeSystem& system, std::unique_ptr<Integrator> integrator)
    : system_(&system), integrator_(std::move(integrator)) {
  integrator_->prepare(system);
}

bool StepMap::step(double t, double h, const double* x, double* x_next) {
  integrator_->restart(t, h, x);
  const StepStatus status = integrator_->step(*system_, t, h, x, x_next);
  return status == StepStatus::kDone ||
         (status == StepStatus::kNotFinite && all_finite({x_next, system_->size()}));
}

}  // namespace sim::study
