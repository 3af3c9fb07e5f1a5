#include "core/study/accuracy/error_estimator.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace sim::study {
namespace {

constexpr double kLeastTolerance = 1e-14;

bool is_tolerance(const Param& param) {
  return param.name == "tol" || param.name == "atol" || param.name == "rtol";
}

}  // namespace

MethodChoice sharper(const Method& own) {
  MethodChoice choice = own.choice();
  for (const Param& param : own.plugin().params) {
    if (param.name == "precision") choice.given[param.name] = std::string("double");
    if (!is_tolerance(param) || !own.params().has(param.name)) continue;
    const double given = own.params().number(param.name);
    const double least = std::max(kLeastTolerance, param.min);
    choice.given[param.name] = std::min(given, std::max(given / kSharper, least));
  }
  return choice;
}

std::optional<MethodChoice> looser(const Method& own) {
  MethodChoice choice = own.choice();
  bool any = false;
  for (const Param& param : own.plugin().params) {
    if (!is_tolerance(param) || !own.params().has(param.name)) continue;
    const double looser = kSharper * own.params().number(param.name);
    if (looser > param.max) return {};
    choice.given[param.name] = looser;
    any = true;
  }
  return any ? std::optional(choice) : std::nullopt;
}

Simulation finer_run(const SystemSpec& spec, Registry& registry, const Settings& own,
                     double steps_per_step, double t, std::span<const double> x) {
  return run_with_method(spec, registry, own, sharper(own.method), own.h / steps_per_step, t, x);
}

Simulation run_with_method(const SystemSpec& spec, Registry& registry, const Settings& own,
                           const MethodChoice& method, double dt, double t,
                           std::span<const double> x) {
  Simulation other(spec, registry, {.integrator = method, .dt = dt});
  auto settings = std::make_shared<Settings>(own);
  settings->method = other.settings().method;
  settings->h = other.settings().h;
  other.restore({std::move(settings), 0, 0, t, {x.begin(), x.end()}, {}});
  return other;
}

// err = C tol, or C h^p: the distance is err (1 - 1/10), or err (1 - 2^-p).
ErrorEstimator::ErrorEstimator(const SystemSpec& spec, const Simulation& run, Registry& registry)
    : fine_(finer_run(spec, registry, run.settings(), 2, run.t(), run.state())) {
  const IntegratorInfo info = run.integrator_info();
  factor_ =
      info.adaptive ? kSharper / (kSharper - 1) : 1 / (1 - std::exp2(-std::max(1, info.order)));
}

void ErrorEstimator::advance(const Simulation& run) {
  const double slack = 1e-9 * fine_.h();
  while (!ended_ && fine_.t() + fine_.h() <= run.t() + slack) ended_ = !fine_.step();
  if (!ended_ && fine_.t() < run.t() - slack) ended_ = !fine_.step_to(run.t());
}

void ErrorEstimator::follow(const Simulation& run) {
  Snapshot now = fine_.snapshot();
  auto settings = std::make_shared<Settings>(run.settings());
  settings->method = now.settings->method;
  settings->h = now.settings->h;
  // Springs that broke in the refined run stay broken, and so do those that the user cut.
  std::vector<int> broken;
  std::ranges::set_union(settings->broken, now.settings->broken, std::back_inserter(broken));
  settings->broken = std::move(broken);
  // Particles that are pinned or dragged stay or move as the user says, not as forces do.
  for (const StatePart& part : run.shape().parts())
    for (const int i : part.item == "particle" ? settings->fixed() : std::vector<int>())
      for (std::size_t c = 0; c < part.components.size(); ++c) {
        const std::size_t at = part.at(static_cast<std::size_t>(i), c);
        now.x[at] = run.state()[at];
      }
  now.settings = std::move(settings);
  fine_.restore(now);
}

void ErrorEstimator::act(const Action& action) { apply(fine_, action); }

std::vector<double> ErrorEstimator::errors(const Simulation& run) {
  advance(run);
  if (run.flat()) {
    double square = 0;
    for (int i = 0; i < run.components(); ++i) {
      const double d = run.component(i) - fine_.component(i);
      square += d * d;
    }
    return {ended_ ? std::nan("") : factor_ * std::sqrt(square)};
  }
  std::vector<double> errors;
  for (int i = 0; i < run.particles(); ++i)
    errors.push_back(ended_ ? std::nan("")
                            : factor_ * (run.position(i) - fine_.position(i)).norm());
  return errors;
}

}  // namespace sim::study
