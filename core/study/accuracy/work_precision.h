// Work-precision studies: every fitting integrator over a range of steps, the efficient points, and
// a recommendation.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/study/accuracy/perturbation_growth.h"
#include "core/study/accuracy/sweep.h"
#include "core/study/limits/spectrum.h"

namespace sim::study {

struct Curve {
  Candidate method;
  std::vector<Point> points;    // from large steps (or tolerances) to small ones
  std::vector<double> cost;     // of each point, in evaluations; implicit methods and single
                                // precision as many as their wall time has room for
  std::optional<double> limit;  // s, the largest stable step at the start, where it is known
  std::optional<ObservedOrder> observed;
  bool late = false;  // smaller steps (or tolerances) take too long, and were not tried
};

struct Place {  // of a point
  std::size_t curve = 0, point = 0;
};

struct WorkPrecision {
  std::string system;
  std::string unit;           // of errors: "m", or nothing for numbers
  double time = 0, size = 1;  // s, m: of the scene, or the range of the quantity that is compared
  double budget = 0;          // m
  double comparable = 0;      // s: beyond it the motion is too sensitive for points to be compared
  Reference reference;
  PerturbationGrowth growth;
  Vibration fastest;    // at the start
  Yardstick yardstick;  // refers to `reference`
  std::vector<Curve> curves;
  std::vector<Place> front;  // not beaten in both cost and error, by rising cost
  // The most accurate point within the budget and well inside the stability limit that costs no
  // more than 5 % above the cheapest; and the cheapest one within the budget. Neither is refused.
  std::optional<Place> recommended, cheapest;
  std::vector<Place> refused;  // by whoever ran them, with all longer steps of these methods
  bool complete = true;        // false when it was told to end

  WorkPrecision() = default;
  WorkPrecision(const WorkPrecision&) = delete;
  WorkPrecision& operator=(const WorkPrecision&) = delete;
  // The required accuracy of the reference: a hundredth of the budget, for a figure a fourth.
  double needed() const;
  const Point& at(Place place) const { return curves[place.curve].points[place.point]; }
  double cost(Place place) const { return curves[place.curve].cost[place.point]; }
};

bool on_front(const WorkPrecision& study, Place place);

// False for a run that failed, or whose error is larger than the scene.
bool stable(const Point& point, double size);

struct WorkPrecisionOptions {
  double time = 0;                             // s; 0 = the scene's duration
  double budget = 1e-3;                        // of the size of the scene
  bool budget_in_metres = false;               // or in metres
  std::vector<MethodChoice> integrators = {};  // empty = all that fit
  int repeats = 5;                             // of each run, for its wall time
};

// The expected duration, s.
double expected(const Problem& problem, const WorkPrecisionOptions& options);

// The last output time at which the reference, and any run in double precision, is known as needed;
// all of a run or nothing if a figure is compared.
int last_comparable(const WorkPrecision& study);

// True if the growth of a disturbance ends the comparison before its time; otherwise the reference
// does.
bool grows_too_far(const WorkPrecision& study);

// Determines costs, front, recommended and cheapest points of the present curves.
void choose(WorkPrecision& study);
void recommend(WorkPrecision& study);  // the last two alone, after some were refused

std::unique_ptr<WorkPrecision> work_precision(const Problem& problem,
                                              const WorkPrecisionOptions& options,
                                              const Watch& watch);

}  // namespace sim::study
