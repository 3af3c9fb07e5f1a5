#include "core/study/accuracy/mending.h"

#include <algorithm>

#include "core/math/elementary.h"

namespace sim::study {

std::optional<double> Mending::after(double fineness, double error, double cost, double free) {
  const bool first = fineness_ == 0;
  if (!first && std::isfinite(error_) && error > 0 && fineness > fineness_)
    exponent_ = std::clamp(elementary::log(error_ / error) / elementary::log(fineness / fineness_),
                           kLeastExponent, refinement_.error());
  fineness_ = fineness;
  error_ = error;
  // A second miss tells of errors that fall unevenly, as in contact.
  const double aim = first ? kAim : kAim * kAim, least = first ? 1.2 : 2;
  const double more = std::isfinite(error)
                          ? elementary::pow(error / (aim * limits_.allowed), 1 / exponent_)
                          : refinement_.factor();
  double next = fineness * std::clamp(more, least, kMostTimesFiner);
  // The error of a run near the limit of stability says little: what a trial has kept is enough.
  if (fineness < 0.9 * limits_.enough) next = std::min(next, limits_.enough);
  if (next > limits_.finest) return {};
  // No fineness is known to be enough: the run is as fine as is free.
  if (!first && exponent_ <= kLeastExponent) {
    next = std::min(next, fineness * elementary::pow(free / cost, 1 / refinement_.cost()));
    if (next < least * fineness) return {};
  }
  cost_ = cost * elementary::pow(next / fineness, refinement_.cost());
  return cost_ > limits_.most_cost ? std::optional<double>{} : next;
}

}  // namespace sim::study
