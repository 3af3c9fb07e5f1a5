// The quantities by which a run is judged, among those that its scene observes: a quantity over
// time, or one figure of it for the whole run, which may be right even if positions cannot.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/scene/scene_spec.h"

namespace sim::study {

enum class Figure { kCourse, kMean, kMost, kLeast, kPeriod };

class Quantity {
 public:
  // "sag": at all times. "mean sag", "max sag", "min sag", "period sag": over the run; with "late "
  // before it over its second half. Throws Error{kUsage} for anything else, and for a name that the
  // system does not observe.
  Quantity(const SystemSpec& spec, const std::string& text);

  const std::string& text() const { return text_; }
  bool is_figure() const { return figure_ != Figure::kCourse; }
  bool is_period() const { return figure_ == Figure::kPeriod; }
  std::size_t observer() const { return observer_; }  // its place in SystemSpec::observers
  double at(const Simulation& system) const { return value_(system); }

  // The figure of values at increasing times (s), with cubics between them: the time average; the
  // vertex of a parabola through the largest value and its neighbours; the mean time between upward
  // crossings of the mean, each after a fall of 5 % of the range below it. Not a number if there is
  // none: values that are not finite, less than two crossings.
  double of(std::span<const double> times, std::span<const double> values) const;

 private:
  std::string text_;
  Figure figure_ = Figure::kCourse;
  bool late_ = false;
  std::size_t observer_ = 0;
  std::function<double(const Simulation&)> value_;
};

// The values of a quantity over a run. Beyond a million every second one is dropped.
class Course {
 public:
  void look(double t, double value);
  double figure(const Quantity& quantity) const { return quantity.of(times_, values_); }

 private:
  std::vector<double> times_, values_;
  std::size_t looks_ = 0, stride_ = 1;
  bool last_stays_ = true;
};

}  // namespace sim::study
