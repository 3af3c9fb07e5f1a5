#include "core/study/accuracy/reference.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/math/elementary.h"
#include "core/study/accuracy/extrapolation.h"
#include "core/study/accuracy/perturbation_growth.h"

namespace sim::study {
namespace {

constexpr double kUnitRoundoff = 1e-16;
constexpr double kWork = 6e7;     // evaluations of a run, of all particles together
constexpr double kNumbers = 4e6;  // kept of a path
constexpr double kGood = 1e-12;   // of the size: nothing better is looked for
constexpr double kRough = 1e-6;   // of the size, for runs that need not be exact
constexpr double kSharpest = 1e-13;
constexpr int kFewest = 60;  // intervals of a path

double affordable(const Simulation& system) {
  return kWork / std::max(64, system.particles() + system.components() / 6);
}

using Points = std::vector<std::vector<double>>;

enum class Family { kRungeKutta, kSplitting, kImplicit };

Family method_family(const Candidate& method) {
  if (method.info.implicit) return Family::kImplicit;
  const bool splits = method.info.symplectic || method.info.needs_second_order;
  return splits ? Family::kSplitting : Family::kRungeKutta;
}

double largest(const std::vector<double>& values) {
  return values.empty() ? HUGE_VAL : *std::ranges::max_element(values);
}

// The quality of the agreement over time, in digits; with divergent motions only the first part
// counts.
double digits(const std::vector<double>& error) {
  double sum = 0;
  for (const double each : error) sum -= elementary::log10(std::max(each, kUnitRoundoff));
  return error.empty() ? -HUGE_VAL : sum / static_cast<double>(error.size());
}

// Finds a reference path and its distance from the path of another method.
class Search {
 public:
  Search(const Problem& problem, double time, const Watch& watch)
      : problem_(problem), time_(time), watch_(watch) {
    Simulation system = problem.simulation();
    size_ = scene_size(system);
    evaluations_ = affordable(system);
    intervals_ = reference_intervals(problem, system);
    breaks_ = system.breaks();
    result_.contact = acts_between_steps(system);
    int& own = result_.own_intervals = breaks_ ? intervals_ : 0;
    while (own > kFewest && own > time / system.h()) own /= 2;
    for (Candidate& method : fitting_methods(problem.with({problem.integrator().name}), {}))
      if (method.info.order > 0 && !method.chooses) methods_.push_back(std::move(method));
    // Explicit methods come first, and those of the highest order; of one order the cheaper.
    std::ranges::stable_sort(methods_, [](const Candidate& a, const Candidate& b) {
      if (a.info.implicit != b.info.implicit) return b.info.implicit;
      return a.info.order != b.info.order ? a.info.order > b.info.order
                                          : a.info.evaluations < b.info.evaluations;
    });
  }

  Reference find();

 private:
  bool go_on(const std::string& what) {
    told_ = told_ || !watch_("reference: " + what, 0.1);
    return !told_;
  }
  bool exact();
  bool extrapolate();
  bool trace(Simulation& system, const Array& start, Points& points);
  void ask_neighbours();
  void ask_shifted_steps();
  double figure_of(const Points& points, std::size_t stride = 1) const;
  std::vector<double> errors_of(const Points& points) const;
  bool integrate(const Candidate& method, std::int64_t steps, double tolerance,
                 const TrajectoryPlan& plan);
  bool follow(const Candidate& method, Points& points, std::optional<std::uint64_t> neighbour = {});
  bool trace_neighbour(std::uint64_t which, Points& points);
  std::optional<std::vector<double>> difference(const Candidate& method, std::int64_t steps,
                                                double tolerance);
  void compare(const Candidate& method);
  void compare_all(std::optional<Family> other);
  void make_rough();
  std::int64_t finest(const Candidate& method) const;

  const Problem& problem_;
  double time_;
  const Watch& watch_;
  double size_, evaluations_;
  int intervals_;
  bool breaks_ = false, told_ = false;
  std::vector<Candidate> methods_;
  Reference result_;
  std::string path_, check_;  // the names of both
  std::optional<Candidate> path_method_;
};

bool Search::exact() {
  if (!problem_.spec->exact || problem_.of) return false;
  Simulation system = problem_.simulation();
  for (int k = 0; k <= intervals_; ++k)
    result_.points.push_back(
        free_coordinates(system, problem_.spec->exact(time_ * k / intervals_)));
  path_ = "exact solution";
  return true;
}

// Uses extrapolation as the path, or as the check of an exact one.
bool Search::extrapolate() {
  const auto method = std::ranges::find(
      methods_, false, [](const Candidate& m) { return m.info.adaptive || m.info.implicit; });
  if (method == methods_.end()) return false;
  Simulation system = problem_.with(*method).simulation();
  if (system.ode().has_inequalities() || acts_between_steps(system)) return false;
  Array start(system.state().size());
  std::ranges::copy(system.state(), start.data());
  Points points;
  if (!trace(system, start, points)) return false;
  if (path_.empty()) {
    path_ = "extrapolation";
    result_.points = std::move(points);
    return true;
  }
  check_ = "extrapolation";
  result_.error = errors_of(points);
  return true;
}

// The distance of another path from ours at each time; for a figure the same number throughout.
std::vector<double> Search::errors_of(const Points& points) const {
  std::vector<double> error;
  if (problem_.by_figure()) {
    const double off = std::abs(figure_of(points) - figure_of(result_.points));
    error.assign(points.size(), std::isfinite(off) ? off : HUGE_VAL);
    return error;
  }
  for (std::size_t k = 0; k < points.size(); ++k)
    error.push_back(distance(points[k], result_.points[k]).most);
  return error;
}

// The points of an extrapolation from that state on.
bool Search::trace(Simulation& system, const Array& start, Points& points) {
  constexpr double kMore = 4;  // evaluations than a run of an integrator
  Extrapolation path(system.ode(), start.data(), static_cast<std::int64_t>(kMore * evaluations_));
  const auto settings = system.snapshot().settings;
  for (int k = 0; k <= intervals_; ++k) {
    const double t = time_ * k / intervals_;
    if (k > 0 && !path.advance(t, [&] { return go_on("extrapolation"); })) return false;
    system.restore({settings, k, k, t, {path.x(), path.x() + system.state().size()}, {}});
    points.push_back(compared(problem_, system));
  }
  return true;
}

double Search::figure_of(const Points& points, std::size_t stride) const {
  Course course;
  for (std::size_t k = 0; k < points.size(); k += stride)
    course.look(time_ * static_cast<double>(k) / intervals_, points[k].front());
  return course.figure(*problem_.of);
}

// Repeats the path from a start perturbed by a rounding error.
bool Search::trace_neighbour(std::uint64_t which, Points& points) {
  if (path_method_) return follow(*path_method_, points, which);
  Simulation system = problem_.simulation();
  Array start(system.state().size());
  disturb(system, kRoundingSeed * size_, which, start.span());
  return trace(system, start, points);
}

// In chaotic motion two runs may agree on a figure by chance. Runs perturbed by a rounding error at
// the start show its uncertainty.
void Search::ask_neighbours() {
  constexpr std::uint64_t kNeighbours = 4;
  for (std::uint64_t each = 0; each < kNeighbours && !told_; ++each) {
    Points points;
    if (!trace_neighbour(each, points)) return;
    const double off = std::abs(figure_of(points) - result_.figure);
    for (double& error : result_.error) error = std::max(error, off);
  }
}

bool Search::integrate(const Candidate& method, std::int64_t steps, double tolerance,
                       const TrajectoryPlan& given) {
  TrajectoryPlan plan = given;
  plan.time = time_;
  plan.steps = steps;
  plan.tolerance = tolerance;
  return run_trajectory(problem_, method, plan, [&] { return go_on(method.name); }).finished;
}

// The largest affordable number of steps, a multiple of the intervals.
std::int64_t Search::finest(const Candidate& method) const {
  constexpr int kImplicit = 50;  // evaluations that an implicit step is worth
  const int cost = method.info.implicit ? kImplicit : std::max(1, method.info.evaluations);
  std::int64_t steps = intervals_;
  while (2 * static_cast<double>(steps) * cost <= evaluations_) steps *= 2;
  return steps;
}

// Uses an integrator as the path if nothing better exists; or as a neighbour of it.
bool Search::follow(const Candidate& method, Points& points,
                    std::optional<std::uint64_t> neighbour) {
  const bool by_tolerance = method.info.adaptive && method.has_tolerance;
  TrajectoryPlan plan{.intervals = intervals_,
                      .see = [&](int, const std::vector<double>& x) { points.push_back(x); }};
  if (neighbour)
    plan.begin = [&](Simulation& system) {
      Snapshot start = system.snapshot();
      disturb(system, kRoundingSeed * size_, *neighbour, start.x);
      start.memory.clear();
      system.restore(start);
    };
  points.clear();
  return integrate(method, by_tolerance ? intervals_ : finest(method), by_tolerance ? kSharpest : 0,
                   plan);
}

std::optional<std::vector<double>> Search::difference(const Candidate& method, std::int64_t steps,
                                                      double tolerance) {
  Points points;
  const auto see = [&](int, const std::vector<double>& x) { points.push_back(x); };
  if (!integrate(method, steps, tolerance, {.intervals = intervals_, .see = see})) return {};
  return errors_of(points);
}

// Refines another method until that no longer helps; kept if it is the best check so far.
void Search::compare(const Candidate& method) {
  const auto keep = [&](const std::optional<std::vector<double>>& error) {
    if (!error || !(digits(*error) > digits(result_.error))) return false;
    result_.error = *error;
    check_ = method.name;
    return true;
  };
  if (method.info.adaptive) {
    if (method.has_tolerance) keep(difference(method, intervals_, kSharpest));
    return;
  }
  const std::int64_t most = finest(method);
  bool better = true;
  for (std::int64_t steps = intervals_; steps <= most && better && !told_; steps *= 2) {
    const auto error = difference(method, steps, 0);
    better = keep(error) || !error;
    if (largest(result_.error) <= kGood * size_) break;
  }
}

// Compares the embedded pairs with adaptive steps, and with equal ones, which interpolate less.
void Search::compare_all(std::optional<Family> other) {
  constexpr int kEnough = 4;
  int tried = 0;
  for (const Candidate& method : methods_) {
    if (told_ || tried == kEnough || largest(result_.error) <= kGood * size_) return;
    if (other && method_family(method) == *other) continue;
    if (method.info.implicit && check_ != "") continue;
    ++tried;
    compare(method);
    if (!method.info.adaptive || largest(result_.error) <= kGood * size_) continue;
    Candidate equal = method;
    equal.given["fixed_step"] = true;
    equal.info.adaptive = false;
    try {
      compare(equal);
    } catch (const Error&) {  // it has no such parameter
    }
  }
}

// Ties break at the ends of steps. Paths whose steps end at the same moments agree on them, however
// late that is. The same path with steps that end in between breaks them half a step sooner or
// later, and they are late by a whole one at most.
void Search::ask_shifted_steps() {
  if (!breaks_ || !path_method_ || told_) return;
  const bool by_tolerance = path_method_->info.adaptive && path_method_->has_tolerance;
  Problem with = problem_.with(*path_method_);
  if (by_tolerance)
    with.options.integrator.given["tol"] = std::max(kSharpest, path_method_->least_tolerance);
  const std::int64_t steps = by_tolerance ? intervals_ : finest(*path_method_);
  Simulation system = with.simulation(time_ / static_cast<double>(steps));
  const auto watched = [&] { return go_on("steps that end in between"); };
  system.stop_when([&] { return !watched(); });
  Points points{compared(problem_, system)};
  bool good = system.step_to(0.5 * system.h());
  for (int k = 1; k <= intervals_ && good; ++k)
    good = look_between_steps(system, time_ * k / intervals_, watched,
                              [&] { points.push_back(compared(problem_, system)); });
  if (!good) return;
  const std::vector<double> error = errors_of(points);
  for (std::size_t k = 0; k < error.size(); ++k)
    result_.error[k] = std::max(result_.error[k], 2 * error[k]);
}

// Finds steps, or a tolerance, that are accurate to 1e-6 of the size.
void Search::make_rough() {
  constexpr double kTolerance = 1e-12;
  for (const Candidate& method : methods_)
    if (method.info.adaptive && method.has_tolerance) {
      result_.method = method;
      result_.method.given["tol"] = kTolerance;
      result_.steps = kIntervals;
      return;
    }
  for (const Candidate& method : methods_) {
    if (method.info.implicit) continue;
    for (std::int64_t steps = 8 * kIntervals; steps <= finest(method) && !told_; steps *= 2) {
      double most = HUGE_VAL;
      const int seen = result_.seen_of(steps);
      const bool finished =
          integrate(method, steps, 0,
                    {.intervals = seen, .see = [&](int k, const std::vector<double>& x) {
                       const auto at = static_cast<std::size_t>(k * (intervals_ / seen));
                       most = std::max(k == 0 ? 0 : most, distance(x, result_.points[at]).most);
                     }});
      if (!finished) continue;
      result_.method = method;
      result_.steps = steps;
      if (most < kRough * size_) return;
    }
    if (result_.steps > 0) return;
  }
}

Reference Search::find() {
  const bool given = exact();
  const bool extrapolated = extrapolate();
  if (told_) return {};
  if (!given && !extrapolated) {
    const auto path = std::ranges::find_if(methods_, [&](const Candidate& method) {
      return !told_ && follow(method, result_.points);
    });
    if (told_) return {};
    if (path == methods_.end())
      throw Error(
          ErrorKind::kUsage,
          {"no reference", "'" + problem_.spec->name + "' to t = " + std::to_string(time_) + " s",
           "no integrator stays finite at the steps that can be waited for",
           "choose a shorter --time"});
    path_ = path->name;
    path_method_ = *path;
    compare_all(method_family(*path));
    if (check_.empty() && !told_) {
      const bool by_tolerance = path->info.adaptive && path->has_tolerance;
      const auto half = difference(*path, by_tolerance ? intervals_ : 2 * finest(*path),
                                   by_tolerance ? 100 * kSharpest : 0);
      check_ = "itself with other steps (no other family fits)";
      result_.error = half.value_or(std::vector<double>(result_.points.size(), HUGE_VAL));
    }
  } else if (result_.error.empty()) {
    compare_all({});
  }
  if (told_) return {};
  result_.how = check_.empty() ? path_ : path_ + " against " + check_;
  result_.error.resize(result_.points.size(), check_.empty() ? 0 : HUGE_VAL);
  ask_shifted_steps();
  if (problem_.by_figure()) {
    result_.figure = figure_of(result_.points);
    if (!std::isfinite(result_.figure))
      throw Error(ErrorKind::kUsage,
                  {"no figure to judge by", "--of '" + problem_.of->text() + "'",
                   problem_.of->is_period() ? "it rises through its mean less than twice"
                                            : "it is not finite on the way",
                   "choose a longer --time, or another quantity"});
    // Half of the points tell a jump between two of them, as in impacts, about as well as all.
    const double sampled = std::abs(figure_of(result_.points, 2) - result_.figure);
    for (double& error : result_.error) error = std::max(error, sampled);
    ask_neighbours();
  }
  for (double& error : result_.error) error = std::max(error, kUnitRoundoff * size_);
  make_rough();
  if (told_) return {};
  return std::move(result_);
}

}  // namespace

int Reference::seen_of(std::int64_t count) const {
  return static_cast<int>(std::gcd(count, static_cast<std::int64_t>(intervals())));
}

int reference_intervals(const Problem& problem, Simulation& system) {
  constexpr int kEvaluations = 16;  // of an interval, about
  const auto numbers = static_cast<double>(compared(problem, system).size());
  const double most = std::min(kNumbers / numbers, affordable(system) / kEvaluations);
  int intervals = kFewest;
  while (2.0 * intervals <= most) intervals *= 2;
  return intervals;
}

double range_of(const Problem& problem, const Reference& reference) {
  if (problem.of->is_period()) return reference.figure;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const auto& point : reference.points) {
    low = std::min(low, point.front());
    high = std::max(high, point.front());
  }
  if (high > low) return high - low;
  return std::abs(high) > 0 ? std::abs(high) : 1;
}

Reference reference(const Problem& problem, double time, const Watch& watch) {
  return Search(problem, time, watch).find();
}

}  // namespace sim::study
