#include "core/study/accuracy/reference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/base/error.h"

namespace sim::study {
namespace {

constexpr double kUnitRoundoff = 1e-16;

using Points = std::vector<std::vector<double>>;

// One method refined until it no longer improves.
struct Refined {
  Candidate method;
  Points points;
  double estimate = std::numeric_limits<double>::infinity();  // of its error, in m
  std::int64_t coarse_steps = 0;  // the first steps good to 1e-6 of the size
};

double largest_distance(const Points& a, const Points& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const double d = distance(a[k], b[k]).most;
    if (!(d <= most)) most = d;
  }
  return most;
}

// x* = x_2N + (x_2N - x_N) / (2^p - 1): the leading term of the error is gone (Richardson 1911).
Points extrapolated(const Points& coarse, const Points& fine, int order) {
  const double factor = 1 / (std::ldexp(1.0, order) - 1);
  Points result = fine;
  for (std::size_t k = 0; k < fine.size(); ++k)
    for (std::size_t i = 0; i < fine[k].size(); ++i)
      result[k][i] += factor * (fine[k][i] - coarse[k][i]);
  return result;
}

class Refinement {
 public:
  Refinement(const Problem& problem, double time, int intervals, const Watch& watch)
      : problem_(problem), time_(time), intervals_(intervals), watch_(watch) {
    const Simulation system = problem.simulation();
    size_ = scene_size(system);
    evaluations_ = 6e7 / std::max(64, system.particles() + system.components() / 6);
  }

  // Nothing when it was told to end.
  std::optional<Refined> refine(const Candidate& method) {
    return method.info.adaptive && method.has_tolerance ? by_tolerance(method) : by_step(method);
  }

 private:
  std::optional<Trajectory> run(const Candidate& method, std::int64_t steps, double tolerance) {
    bool told = false;
    Trajectory result =
        run_trajectory(problem_, method, {time_, intervals_, steps, tolerance, false}, [&] {
          told = told || !watch_("reference: " + method.name, 0.1);
          return !told;
        });
    if (told) return {};
    return result;
  }

  // Steps are halved until halving changes no more than rounding does, or things get worse.
  std::optional<Refined> by_step(const Candidate& method) {
    Refined best{method, {}, std::numeric_limits<double>::infinity(), 0};
    Points last;
    double last_change = std::numeric_limits<double>::infinity();
    const int cost = std::max(1, method.info.evaluations);
    std::int64_t finest = 0;
    for (std::int64_t steps = 8 * intervals_; static_cast<double>(steps) * cost <= evaluations_;
         steps *= 2) {
      const auto fine = run(method, steps, 0);
      if (!fine) return {};
      if (!fine->finished) {
        last.clear();
        continue;
      }
      if (!last.empty()) {
        const double change = largest_distance(last, fine->points);
        const double gain = std::ldexp(1.0, method.info.order) - 1;
        if (best.coarse_steps == 0 && change / gain < 1e-6 * size_) best.coarse_steps = steps;
        // Rounding has taken over when halving gains less than a factor of two.
        const bool converging = change < 0.5 * last_change || change > 1e-6 * size_;
        if (!converging && best.coarse_steps > 0) break;
        if (change / gain <= best.estimate) {
          best.estimate = change / gain;
          best.points = extrapolated(last, fine->points, method.info.order);
        }
        last_change = change;
        if (change <= 10 * kUnitRoundoff * size_) break;
      }
      last = fine->points;
      finest = steps;
    }
    if (best.coarse_steps == 0) best.coarse_steps = finest;
    return best;
  }

  std::optional<Refined> by_tolerance(const Candidate& method) {
    Refined best{method, {}, std::numeric_limits<double>::infinity(), 0};
    Points last;
    for (const double tolerance : {1e-9, 1e-11, 1e-13}) {
      const auto fine = run(method, intervals_, tolerance);
      if (!fine) return {};
      if (!fine->finished) continue;
      if (!last.empty()) {
        const double change = largest_distance(last, fine->points);
        if (change <= best.estimate) {
          best.estimate = change;
          best.points = fine->points;
        }
      }
      last = fine->points;
      best.coarse_steps = intervals_;
    }
    return best;
  }

  const Problem& problem_;
  double time_;
  int intervals_;
  const Watch& watch_;
  double size_, evaluations_;
};

// Explicit methods as they are without values from a scene, those of the highest order first; of
// one order the cheaper.
std::vector<Candidate> candidates(const Problem& problem) {
  std::vector<Candidate> methods = fitting_methods(problem.with({problem.integrator().name}), {});
  std::erase_if(methods, [](const Candidate& m) { return m.info.implicit || m.info.order < 1; });
  std::stable_sort(methods.begin(), methods.end(), [](const Candidate& a, const Candidate& b) {
    return a.info.order != b.info.order ? a.info.order > b.info.order
                                        : a.info.evaluations < b.info.evaluations;
  });
  return methods;
}

Reference exact_reference(const Problem& problem, double time, int intervals) {
  Simulation system = problem.simulation();
  Reference result;
  result.how = "exact solution";
  const double rounding = 10 * kUnitRoundoff * scene_size(system);
  for (int k = 0; k <= intervals; ++k) {
    result.points.push_back(free_coordinates(system, problem.spec->exact(time * k / intervals)));
    result.error.push_back(rounding);
  }
  return result;
}

}  // namespace

Reference reference(const Problem& problem, double time, int intervals, const Watch& watch) {
  Reference result;
  const bool exact = static_cast<bool>(problem.spec->exact);
  if (exact) result = exact_reference(problem, time, intervals);

  const std::vector<Candidate> methods = candidates(problem);
  Refinement refinement(problem, time, intervals, watch);
  std::optional<Refined> first, second;
  for (const Candidate& method : methods) {
    // The second one belongs to another family: symplectic or not.
    if (first && !exact && method.info.symplectic == first->method.info.symplectic) continue;
    auto refined = refinement.refine(method);
    if (!refined) return {};
    if (refined->points.empty()) continue;
    (first ? second : first) = std::move(refined);
    if (second || exact) break;
  }
  for (const Candidate& method : methods) {
    if (exact || second || !first || method.name == first->method.name) continue;
    auto refined = refinement.refine(method);
    if (!refined) return {};
    if (!refined->points.empty()) second = std::move(refined);
  }
  if (!first && !exact)
    throw Error(
        ErrorKind::kUsage,
        {"no reference", "'" + problem.spec->name + "' to t = " + std::to_string(time) + " s",
         "no integrator stays finite at the steps that can be waited for",
         "choose a shorter --time"});
  if (first) {
    result.method = first->method;
    result.steps = first->coarse_steps;
  }
  if (exact) return result;

  if (second && second->estimate < first->estimate) std::swap(*first, *second);
  result.how = first->method.name + (second ? " against " + second->method.name : "");
  result.points = first->points;
  Simulation system = problem.simulation();
  const double rounding = kUnitRoundoff * scene_size(system);
  for (std::size_t k = 0; k < result.points.size(); ++k) {
    const double difference =
        second ? distance(result.points[k], second->points[k]).most : first->estimate;
    result.error.push_back(std::max(difference, rounding));
  }
  result.method = first->method;
  result.steps = first->coarse_steps;
  return result;
}

}  // namespace sim::study
