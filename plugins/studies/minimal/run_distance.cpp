#include "run_distance.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/base/stopwatch.h"
#include "core/study/accuracy/trajectory.h"

namespace sim::study {
namespace {

constexpr int kLooks = 50;

using Place = std::array<double, 3>;

std::vector<double> positions(const Simulation& system) {
  std::vector<double> values;
  if (system.flat()) {
    for (int i = 0; i < system.components(); ++i) values.push_back(system.component(i));
    return values;
  }
  for (int i = 0; i < system.particles(); ++i) {
    const Vec3 x = system.position(i);
    values.insert(values.end(), {x[0], x[1], x[2]});
  }
  return values;
}

// One run to the looks, which do not shorten its steps; false when it fails or is told to end.
bool run_once(const Problem& problem, double time, const std::function<bool()>& go_on, bool record,
              Look& look, bool& told) {
  Simulation system = problem.simulation();
  double seconds = 0, potential = 0;
  Course course;
  const bool each_step = record && problem.by_figure();
  const auto follow = [&] {
    if (each_step) course.look(system.t(), problem.of->at(system));
  };
  const auto see = [&] {
    if (!record) return;
    look.positions.push_back(positions(system));
    look.observed.push_back(problem.spec->observe(system));
    if (!system.second_order()) return;
    const Energy energy = system.energy();
    if (look.energies.empty()) potential = energy.potential;
    look.energies.push_back(energy.total());
    look.in_play = std::max(look.in_play, energy.kinetic + std::abs(energy.potential - potential));
  };
  if (record) {
    look.size = scene_size(system);
    look.flat = system.flat();
  }
  see();
  follow();
  for (int k = 1; k <= kLooks; ++k) {
    told = told || !go_on();
    if (told) return false;
    const double end = time * k / kLooks;
    const Stopwatch watch;
    const double rounding = 1e-9 * system.h();
    bool good = true;
    while (good && system.t() < end - rounding) {
      const auto whole =
          static_cast<std::int64_t>((end - system.t()) / system.h() * (1 + 1e-12) + 1e-9);
      if (whole == 0 && k < kLooks) break;
      const std::int64_t most = each_step ? 1 : 1024;
      good = whole > 0 ? system.steps(std::min(whole, most)) > 0 : system.step_to(end);
      if (good) follow();
    }
    seconds += watch.seconds();
    if (!good || (record && !look_between_steps(system, end, go_on, see))) return false;
  }
  look.seconds = record ? seconds : std::min(look.seconds, seconds);
  if (!record) return true;
  if (each_step) look.figure = course.figure(*problem.of);
  look.evaluations = evaluations_of(system);
  return true;
}

Place at(const std::vector<double>& values, std::size_t i) {
  return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

// The position of each particle of a scene in its box, 0 to 1 along each axis.
std::vector<Place> in_box(const std::vector<double>& values, Place& extent) {
  Place low, high;
  low.fill(HUGE_VAL);
  high.fill(-HUGE_VAL);
  for (std::size_t i = 0; i < values.size() / 3; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], values[3 * i + axis]);
      high[axis] = std::max(high[axis], values[3 * i + axis]);
    }
  std::vector<Place> result(values.size() / 3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    extent[axis] = high[axis] - low[axis];
    for (std::size_t i = 0; i < result.size(); ++i)
      result[i][axis] = extent[axis] > 0 ? (values[3 * i + axis] - low[axis]) / extent[axis] : 0;
  }
  return result;
}

double distance_of(const Place& a, const Place& b) {
  double square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) square += (a[axis] - b[axis]) * (a[axis] - b[axis]);
  return std::sqrt(square);
}

// For each particle of `few` the one of `many` that stands nearest at the start.
std::vector<std::size_t> nearest_of(const std::vector<Place>& few, const std::vector<Place>& many) {
  std::vector<std::size_t> ids;
  for (const Place& place : few) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < many.size(); ++i)
      if (distance_of(many[i], place) < distance_of(many[best], place)) best = i;
    ids.push_back(best);
  }
  return ids;
}

double largest_place(const Look& whole, const Look& other) {
  double most = 0;
  const std::size_t looks = std::min(whole.positions.size(), other.positions.size());
  const bool same = whole.positions.front().size() == other.positions.front().size();
  if (whole.flat || (same && other.flat)) {
    if (!same) return HUGE_VAL;
    for (std::size_t k = 0; k < looks; ++k)
      for (std::size_t i = 0; i < whole.positions[k].size(); ++i)
        most = std::max(most, std::abs(whole.positions[k][i] - other.positions[k][i]));
    return most;
  }
  if (same) {
    for (std::size_t k = 0; k < looks; ++k)
      for (std::size_t i = 0; i < whole.positions[k].size() / 3; ++i)
        most = std::max(most, distance_of(at(whole.positions[k], i), at(other.positions[k], i)));
    return most;
  }
  Place extent{}, own{};
  const std::vector<Place> many = in_box(whole.positions.front(), extent);
  const std::vector<Place> few = in_box(other.positions.front(), own);
  const std::vector<std::size_t> ids = nearest_of(few, many);
  for (std::size_t k = 0; k < looks; ++k)
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const Place start = at(whole.positions.front(), ids[i]), now = at(whole.positions[k], ids[i]);
      const Place other_start = at(other.positions.front(), i),
                  other_now = at(other.positions[k], i);
      Place way, other_way;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        way[axis] = now[axis] - start[axis];
        other_way[axis] = other_now[axis] - other_start[axis];
      }
      most = std::max(most, distance_of(way, other_way));
    }
  return most;
}

}  // namespace

std::optional<Look> look_at(const Problem& problem, double time,
                            const std::function<bool()>& go_on) {
  constexpr int kRepeats = 2, kMostRepeats = 30;  // more, for the time
  constexpr double kEnough = 0.01, kShort = 0.2;  // s, of all repeats; of one
  Look look;
  bool told = false;
  look.finished = run_once(problem, time, go_on, true, look, told);
  const auto noisy = [&](int i) {
    return i < kRepeats ? look.seconds < kShort : i * look.seconds < kEnough;
  };
  for (int i = 0; i < kMostRepeats && look.finished && !told && noisy(i); ++i)
    run_once(problem, time, go_on, false, look, told);
  if (told) return {};
  for (std::size_t i = 0; i < problem.spec->observers.size(); ++i) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const auto& each : look.observed) {
      low = std::min(low, each[i]);
      high = std::max(high, each[i]);
    }
    look.ranges.push_back(high > low ? high - low : std::abs(high));
  }
  return look;
}

RunDistance run_distance(const Look& whole, const Look& other) {
  RunDistance result;
  if (!other.finished) {
    result.positions = result.energy = result.figure = HUGE_VAL;
    result.observed.assign(whole.ranges.size(), HUGE_VAL);
    return result;
  }
  result.positions = largest_place(whole, other) / whole.size;
  result.figure = std::abs(whole.figure - other.figure);
  if (!whole.energies.empty() && whole.in_play > 0) {
    result.energy = 0;
    for (std::size_t k = 0; k < std::min(whole.energies.size(), other.energies.size()); ++k)
      result.energy =
          std::max(result.energy, std::abs(whole.energies[k] - other.energies[k]) / whole.in_play);
  }
  for (std::size_t i = 0; i < whole.ranges.size(); ++i) {
    double most = 0;
    for (std::size_t k = 0; k < other.observed.size(); ++k)
      most = std::max(most, std::abs(whole.observed[k][i] - other.observed[k][i]));
    result.observed.push_back(most);
  }
  return result;
}

}  // namespace sim::study
