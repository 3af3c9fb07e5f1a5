// Extrapolation of the modified midpoint rule: a method of very high order that shares nothing with
// the integrators a study compares.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"

namespace sim::study {

// Gragg (1965), Bulirsch & Stoer (1966). Increments are extrapolated, not states, and added with
// compensation, so that thousands of steps cause few rounding errors.
class Extrapolation {
 public:
  // The system outlives it, and X begins with the state `x` at t = 0. Not for confined systems.
  Extrapolation(OdeSystem& system, const double* x, std::int64_t most_evaluations);

  // Advances to the time `end` exactly. False if that takes too many evaluations or too small
  // steps, if a number is not finite, or if `go_on` says so.
  bool advance(double end, const std::function<bool()>& go_on);

  const double* x() const { return x_.data(); }
  std::int64_t evaluations() const { return evaluations_; }

 private:
  static constexpr int kColumns = 8;

  // Takes one step; returns the columns used, 0 if it did not converge.
  int step(double h);
  void midpoint(double h, int substeps, Array& increment);
  void eval(double t, const Array* increment, Array& rate);
  bool converged(const Array& increment, const Array& coarser);
  void add(const Array& increment);

  OdeSystem* system_;
  std::int64_t most_, evaluations_ = 0;
  double t_ = 0, h_ = 0;
  std::vector<std::pair<std::size_t, std::size_t>> groups_;  // of numbers of one size
  std::vector<double> scale_, now_;                          // of each group, the largest so far
  Array x_, carry_, rate0_, rate_, y_, older_, newer_, row_;
  std::vector<Array> table_;  // of Neville, the last row
};

}  // namespace sim::study
