// One method at many steps (or tolerances): its error and its cost.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/stopwatch.h"
#include "core/study/accuracy/reference.h"

namespace sim::study {

struct Point {
  double dt = 0, tolerance = 0;            // s; the tolerance of adaptive methods, otherwise 0
  bool finished = false;                   // otherwise the run left the finite numbers, or failed
  double rms_end = 0;                      // m, over the free coordinates at the end
  double rms = 0;                          // m, the largest of all steps: the "error" elsewhere
  double most_end = 0;                     // m, of any coordinate at the end
  int worst = 0;                           // the particle (or component) of most_end
  double energy = 0;                       // as Trajectory::energy_error
  std::optional<ConstraintDrift> drift{};  // at the end, where there are constraints
  std::int64_t steps = 0;
  Effort effort;
  double seconds = 0, spread = 0;  // of stepping: median and range of the repeats
};

// The limits on the cost of a sweep.
struct SweepLimits {
  double evaluations;  // of one run of 64 particles; fewer in larger scenes
  int implicit_cost;   // evaluations that an implicit step is worth
  double seconds;      // after a run of that length none with smaller steps

  double evaluations_for(const Simulation& system) const;
  int cost_of_step(const Candidate& method) const;
};

// The time of an evaluation, s, measured for a few milliseconds, at the present state.
double seconds_an_evaluation(Simulation& system);

// The reference of a sweep, and the time up to which comparison is meaningful.
struct Yardstick {
  const Reference* reference = nullptr;
  double time = 0;  // s, of the whole run
  double size = 1;  // m, of the scene
  int last = 0;     // the point of the reference up to which runs are compared
  bool energy = true;
  int repeats = 0;      // of timing
  double rounding = 0;  // m, the rounding error of a position in the method's precision
  bool figure = false;  // one number is compared, see Quantity

  Yardstick of(const Candidate& method) const;  // the same with its rounding
  // The floor below which errors are meaningless: 10 times the reference's own, or rounding; for a
  // figure its own, and no error is then smaller.
  double floor() const;
};

// fitting_methods() for a study that chooses the tolerances itself: a method of the run is included
// without its own. Throws Error{kUsage} for a choice with one.
std::vector<Candidate> methods_to_sweep(const Problem& problem, const Simulation& run,
                                        const std::vector<MethodChoice>& choices);

// Polled in a run, which may take, with its repeats, eight times the limit: then the method has no
// finer runs.
class Patience {
 public:
  Patience(const SweepLimits& limits, const std::function<bool()>& go_on)
      : most_(8 * limits.seconds), go_on_(go_on) {}
  bool ask() { return !late() && go_on_(); }
  bool late() const { return watch_.seconds() > most_; }

 private:
  double most_;  // s
  const std::function<bool()>& go_on_;
  Stopwatch watch_;
};

// The number of repetitions that time a run of so many seconds: many short ones, few long ones.
int repeats_after(double seconds, int wanted);

// True if states that are shown end no step: those of methods with steps of their own; but implicit
// ones end a step at each where there is contact.
bool has_dense_output(const IntegratorInfo& info, bool contact);

// Measures `steps` steps in all (a multiple of kIntervals), or adaptive steps with a tolerance.
// Sampled at each step that is a point of the reference, or with a tolerance at all of these. Empty
// if told to end.
std::optional<Point> measure(const Problem& problem, const Candidate& method, std::int64_t steps,
                             double tolerance, const Yardstick& yardstick,
                             const std::function<bool()>& go_on);

// The slope of log error over log step size, from the points whose local orders agree.
struct ObservedOrder {
  double slope = 0, standard_error = 0;
  double constant = 0;  // error = constant h^slope
  int points = 0;
};

// Points in the order of decreasing dt (or tolerance). Uses those above 10 times the floor and
// below 1e-2 of the scene whose local orders differ by less than 0.3, three at least; otherwise
// empty. For adaptive methods h is the mean step, time / internal steps, and 1.5 is allowed.
std::optional<ObservedOrder> observed_order(const std::vector<Point>& points,
                                            const Yardstick& yardstick);

}  // namespace sim::study
