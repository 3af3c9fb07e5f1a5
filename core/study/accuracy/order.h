// The observed order of convergence of methods on a system.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/study/accuracy/sweep.h"

namespace sim::study {

struct MethodOrder {
  Candidate method;
  std::vector<Point> points;  // each at half the step (or a tenth of the tolerance)
  std::optional<ObservedOrder> observed;
};

struct OrderStudy {
  std::string system, unit;   // of errors: "m", or nothing for numbers
  double time = 0, size = 1;  // s, m
  Reference reference;
  Yardstick yardstick;  // refers to `reference` of the same study
  std::vector<MethodOrder> methods;
  bool complete = true;  // false when it was told to end

  OrderStudy() = default;
  OrderStudy(const OrderStudy&) = delete;
  OrderStudy& operator=(const OrderStudy&) = delete;
};

struct OrderOptions {
  double time = 0;  // s; 0 = a tenth of the scene's duration, at least 2 periods
  std::vector<MethodChoice> integrators = {};  // empty = all that fit
};

// The expected duration, s.
double expected(const Problem& problem, const OrderOptions& options);

std::unique_ptr<OrderStudy> order(const Problem& problem, const OrderOptions& options,
                                  const Watch& watch);

// True if it is at most 0.15 below the order it claims, 0.3 from order 6 on, 0.7 if a tolerance
// chooses the steps; a higher order is no fault.
bool keeps_order(const MethodOrder& method);

}  // namespace sim::study
