#include "core/study/problem.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/base/error.h"
#include "core/base/finite.h"

namespace sim::study {
namespace {

// Parameters given to the integrator of the run hold for no other one.
RunOptions options_for(const Problem& problem, const std::string& name) {
  RunOptions options = problem.options;
  const std::string& own =
      options.integrator.empty() ? problem.spec->integrator : options.integrator;
  Registry& registry = *problem.registry;
  if (!name.empty() && registry.integrator(name).name != registry.integrator(own).name) {
    options.integrator = name;
    options.integrator_given.clear();
  }
  return options;
}

}  // namespace

std::vector<Choice> choices(const std::vector<std::string>& names) {
  std::vector<Choice> list;
  for (const std::string& name : names) list.push_back({name});
  return list;
}

Problem Problem::with(const Choice& choice) const {
  Problem changed{spec, registry, options_for(*this, choice.name)};
  if (choice.given.empty()) return changed;
  changed.options.integrator = choice.name;
  changed.options.integrator_given = choice.given;
  return changed;
}

Simulation Problem::simulation(const std::string& name, double dt) const {
  RunOptions run = options_for(*this, name);
  if (dt > 0) run.dt = dt;
  return Simulation(*spec, *registry, run);
}

std::unique_ptr<Integrator> Problem::integrator(const std::string& name) const {
  const RunOptions run = options_for(*this, name);
  const IntegratorPlugin& plugin =
      registry->integrator(run.integrator.empty() ? spec->integrator : run.integrator);
  std::map<std::string, Value> given = run.integrator_given;
  if (run.integrator.empty())
    given.insert(spec->integrator_given.begin(), spec->integrator_given.end());
  return plugin.make(Params("integrator '" + plugin.name + "'", plugin.params, given, spec->place));
}

std::unique_ptr<Integrator> Problem::integrator(const Simulation& like) const {
  return registry->integrator(like.integrator_plugin().name).make(like.integrator_params());
}

std::vector<Method> fitting_methods(const Problem& problem, const std::vector<Choice>& given) {
  std::vector<Choice> wanted = given;
  if (wanted.empty()) wanted = choices(problem.registry->names(PluginKind::kIntegrator));
  std::vector<Method> methods;
  for (Choice& choice : wanted) {
    try {
      const IntegratorPlugin& plugin =
          problem.registry->integrator(choice.name, "on the command line");
      const auto has = [&](auto what) {
        return std::any_of(plugin.params.begin(), plugin.params.end(), what);
      };
      if (given.empty() && has([](const Param& param) { return param.required; })) continue;
      const IntegratorInfo info = problem.with(choice).simulation().integrator_info();
      if (choice.label == choice.name) choice.label = plugin.name;
      choice.name = plugin.name;
      methods.push_back({choice, info, has([](const Param& param) { return param.name == "tol"; }),
                         static_cast<bool>(plugin.make_from_others)});
    } catch (const Error& error) {
      if (given.empty()) continue;
      throw Error(ErrorKind::kUsage, error.text());
    }
  }
  return methods;
}

const ParticleSystem* particles_of(Simulation& system) {
  return dynamic_cast<const ParticleSystem*>(&system.ode());
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
