#include "core/engine/first_steps.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sim::engine {
namespace {

std::vector<double> places_of(const Simulation& system) {
  std::vector<double> places;
  places.reserve(3 * static_cast<std::size_t>(system.particles()));
  for (int i = 0; i < system.particles(); ++i) {
    const Vec3 x = system.position(i);
    places.insert(places.end(), {x.x(), x.y(), x.z()});
  }
  return places;
}

double rms_between(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return a.empty() ? 0 : std::sqrt(sum / static_cast<double>(a.size()));
}

}  // namespace

FirstSteps::FirstSteps(Simulation& system, std::int64_t most) {
  const Snapshot before = system.snapshot();
  start_ = places_of(system);
  const std::int64_t wanted = std::min(kExactSteps, most);
  const auto run_on = [&] {
    std::int64_t done = 0;
    while (done < wanted) {
      const int taken = system.steps(wanted - done);
      if (taken == 0) return false;
      done += taken;
    }
    return true;
  };
  if (wanted > 0 && run_on()) {
    step_ = system.step_count();
    end_ = places_of(system);
    way_ = rms_between(end_, start_);
    double size = 0;
    for (const double x : start_) size = std::max(size, std::fabs(x));
    Snapshot shifted = before;
    bool up = false;
    const StatePart& position = *system.shape().find("position");
    for (int i = 0; i < system.particles(); ++i) {
      if (system.pinned(i)) continue;
      for (std::size_t axis = 0; axis < 3; ++axis, up = !up)
        shifted.x[position.at(static_cast<std::size_t>(i), axis)] +=
            (up ? 1 : -1) * std::numeric_limits<double>::epsilon() * size;
    }
    system.restore(shifted);
    if (run_on()) parted_ = rms_between(places_of(system), end_);
  }
  system.restore(before);
}

FirstSteps::Answer FirstSteps::compare(const Simulation& system) const {
  // A correct run of other roundings in each step; a wrong one is off by far more.
  constexpr double kMany = 1e3, kLeastDigits = 10;
  const double apart = rms_between(places_of(system), end_);
  if (apart == 0) return {std::numeric_limits<double>::infinity(), true};
  const double digits = way_ > 0 ? -std::log10(apart / way_) : 0;
  return {digits, digits >= kLeastDigits || apart <= kMany * parted_};
}

}  // namespace sim::engine
