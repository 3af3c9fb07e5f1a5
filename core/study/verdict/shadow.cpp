#include "core/study/verdict/shadow.h"

#include <algorithm>

#include "core/base/array.h"
#include "core/base/noise.h"
#include "core/particles/particle_system.h"
#include "core/study/accuracy/companion.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr std::size_t kMostFrames = 100, kMostNumbers = std::size_t{1} << 22;  // kept of a run
constexpr int kNeighbours = 3;             // asked for what is observed, where it is chaotic
constexpr std::size_t kFewNumbers = 1000;  // of a flat state
constexpr double kLittle = 0.01;           // of the largest number of a run
constexpr int kFinestStates = 200;         // that an adaptive shadow shows, at least

// Of every particle, pinned or not, or the numbers of a flat state.
std::vector<double> places(Simulation& system) {
  if (!system.second_order()) return {system.state().begin(), system.state().end()};
  const ParticleView p = particles_of(system)->view(system.t(), system.state().data());
  std::vector<double> values(static_cast<std::size_t>(3 * p.n));
  double* next = values.data();
  for (int i = 0; i < p.n; ++i)
    for (const double* axis : {p.x, p.y, p.z}) *next++ = axis[i];
  return values;
}

// Largest distance of a particle, or difference of a number of a flat state.
double largest_distance(const std::vector<double>& a, const std::vector<double>& b, bool flat) {
  double most = 0;
  const std::size_t width = flat ? 1 : 3;
  for (std::size_t i = 0; i < a.size(); i += width) {
    double square = 0;
    for (std::size_t k = i; k < i + width; ++k) square += (a[k] - b[k]) * (a[k] - b[k]);
    const double distance = std::sqrt(square);
    if (!(distance <= most)) most = distance;  // not a number counts as the worst
  }
  return std::isnan(most) ? HUGE_VAL : most;
}

double largest_number(const std::vector<double>& numbers) {
  double most = 0;
  for (const double number : numbers) most = std::max(most, std::abs(number));
  return most;
}

// What is judged of a run, at each of its steps.
class Courses {
 public:
  explicit Courses(const std::vector<Quantity>& asked) : asked_(&asked), courses_(asked.size()) {}

  void look(const Simulation& system) {
    for (std::size_t i = 0; i < courses_.size(); ++i)
      courses_[i].look(system.t(), (*asked_)[i].at(system));
  }
  std::vector<double> figures() const {
    std::vector<double> figures;
    for (std::size_t i = 0; i < courses_.size(); ++i)
      figures.push_back(courses_[i].figure((*asked_)[i]));
    return figures;
  }

 private:
  const std::vector<Quantity>* asked_;
  std::vector<Course> courses_;
};

}  // namespace

Shadow::Shadow(const SystemSpec& spec, Simulation& run, std::int64_t steps, Registry& registry)
    : spec_(&spec),
      run_(&run),
      registry_(&registry),
      start_(run.snapshot()),
      last_step_(run.step_count() + steps) {
  const auto numbers = std::max<std::size_t>(1, run.state().size());
  const auto most = std::clamp<std::size_t>(kMostNumbers / numbers, 4, kMostFrames);
  constexpr std::int64_t kLooks = 100;
  stride_ = std::max<std::int64_t>(1, kLooks / static_cast<std::int64_t>(most));
  const ParticleSystem* particles = particles_of(run);
  may_jump_ = !particles || std::ranges::any_of(particles->other_forces(), [](const Force* force) {
    return !force->conservative() && !force->resists() && !force->springs();
  });
}

void Shadow::look(const Energy* energy, std::span<const double> observed) {
  if (energy) {
    if (frames_.empty()) start_potential_ = energy->potential;
    in_play_ = std::max(in_play_, energy->kinetic + std::abs(energy->potential - start_potential_));
  }
  if (looks_++ % stride_ != 0 && run_->step_count() != last_step_) return;
  std::vector<double> x = places(*run_);
  const double largest = run_->flat() ? largest_number(x) : 0;
  frames_.push_back({run_->step_count(),
                     run_->t(),
                     std::move(x),
                     largest,
                     energy ? energy->total() : std::nan(""),
                     {observed.begin(), observed.end()},
                     may_jump_ ? std::vector(run_->state().begin(), run_->state().end())
                               : std::vector<double>()});
}

// The same run from its first state, with finer settings: `steps_per_step` steps for each of its
// own.
Simulation Shadow::finer_run(double& steps_per_step) const {
  const Settings& own = run_->settings();
  const auto taken = static_cast<double>(frames_.back().step - frames_.front().step);
  steps_per_step = run_->integrator_info().adaptive
                       ? std::clamp(std::ceil(kFinestStates / taken), 1.0, double(kFinestStates))
                       : finer_steps(taken);
  return study::finer_run(*spec_, *registry_, own, steps_per_step, start_.t(), start_.x);
}

// Two for each step that the method takes; more where there are so few that two are no finer look
// at what happens. A method that chooses its steps inside ours tells by its evaluations.
double Shadow::finer_steps(double taken) const {
  constexpr double kFewest = 64, kMost = 32;
  const int each = run_->integrator_info().evaluations;
  const auto evaluations = static_cast<double>(run_->integrator().effort().evaluations);
  const double inside = each > 0 ? std::max(1.0, std::round(evaluations / (each * taken))) : 1;
  return 2 * inside * std::clamp(std::ceil(kFewest / (2 * inside * taken)), 1.0, kMost);
}

// The extent of the scene, then or at the start; of a single point how far it comes in the run; of
// numbers the largest, or where that is near 0 what it usually is or a share of what it becomes.
double Shadow::size_at(const Frame& frame) const {
  const Frame& first = frames_.front();
  double size = 0;
  if (run_->flat()) {
    std::vector<double> sizes{0};
    if (first.x.size() <= kFewNumbers)
      for (const Frame& each : frames_) sizes.push_back(each.largest);
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::ranges::nth_element(sizes, middle);
    const double usual = *middle;
    return std::max(
        {first.largest, frame.largest, usual, kLittle * *std::ranges::max_element(sizes)});
  }
  for (const Frame* each : {&first, &frame})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double low = HUGE_VAL, high = -HUGE_VAL;
      for (std::size_t i = axis; i < each->x.size(); i += 3) {
        low = std::min(low, each->x[i]);
        high = std::max(high, each->x[i]);
      }
      size = std::max(size, high - low);
    }
  if (size > 0) return size;
  for (const Frame& each : frames_) size = std::max(size, largest_distance(each.x, first.x, false));
  if (!run_->second_order())
    size = std::max(size, largest_distance(frame.x, std::vector(frame.x.size(), 0.0), false));
  return size;
}

double Shadow::usual_size() const {
  const double start = size_at(frames_.front());
  return start > 0 ? start : size_at(frames_.back());
}

double Shadow::take_error(double error, const Frame& frame, Parting& result) const {
  const double size = size_at(frame);
  const double share = size > 0 ? error / size : error > 0 ? HUGE_VAL : 0;
  if (!(error <= result.error)) result.error = error;
  if (!(share <= result.share)) result.share = share;
  if (share > Parting::kWrong) result.horizon = std::min(result.horizon, frame.t);
  return size;
}

void Shadow::compare_frame(const Frame& frame, double factor, Simulation& shadow,
                           Parting& result) const {
  result.at_end = factor * largest_distance(frame.x, places(shadow), run_->flat());
  const double size = take_error(result.at_end, frame, result);
  if (!frame.observed.empty()) {
    const std::vector<double> observed = spec_->observe(shadow);
    result.observed.resize(observed.size());
    for (std::size_t i = 0; i < observed.size(); ++i) {
      Parted& parted = result.observed[i];
      parted.at_end = std::abs(frame.observed[i] - observed[i]);
      if (!(parted.at_end <= parted.most)) parted.most = parted.at_end;
    }
  }
  const double moved = largest_distance(frame.x, frames_.front().x, run_->flat());
  if (!run_->second_order() || !(in_play_ > 0)) return;
  if (moved <= at_rest(run_->integrator_info()) * size) return;
  const double energy = std::abs(frame.energy - shadow.energy().total()) / in_play_;
  if (!(energy <= result.energy)) result.energy = energy;
}

// The last step of a run may be shorter than the others; its part of the finer run is then cut as
// many times.
bool Shadow::take(Simulation& finer, double steps_per_step, std::size_t frame,
                  const std::function<bool()>& stop, const std::function<void()>& each,
                  std::int64_t stride) const {
  const Frame &from = frames_[frame - 1], &to = frames_[frame];
  const auto steps = static_cast<double>(to.step - from.step), h = run_->h();
  const bool cut = to.t < from.t + (steps - 1e-6) * h;
  const auto run = [&](double count) {
    for (auto left = static_cast<std::int64_t>(count); left > 0;) {
      const int taken = stop() ? 0 : finer.steps(each ? std::min(left, stride) : left);
      if (taken == 0) return false;
      left -= taken;
      if (each) each();
    }
    return true;
  };
  if (!cut) return run(steps_per_step * steps);
  if (!run(steps_per_step * (steps - 1))) return false;
  finer.set_dt((to.t - finer.t()) / steps_per_step);
  return run(steps_per_step);
}

Parting Shadow::compare(const std::function<bool()>& stop, bool spread) {
  Parting result;
  if (frames_.size() < 2) return result;
  double finer = 1;
  Simulation shadow = finer_run(finer);
  std::vector<std::vector<double>> path{frames_.front().x};
  // err = C tol, or C h^p: the difference to the shadow is err (1 - finer^-p).
  const IntegratorInfo info = run_->integrator_info();
  const double factor = info.adaptive ? kSharper / (kSharper - 1)
                                      : 1 / (1 - std::pow(finer, -std::max(1, info.order)));
  shadow.stop_when(stop);
  const bool watch_strain = run_->second_order() && run_->integrator_info().adaptive && finer > 1;
  Courses courses(asked_);
  // Every step where something is judged, or else as often as shows a spring that turns round.
  constexpr double kLooksAtSprings = 2000;
  const double steps = finer * static_cast<double>(frames_.back().step - frames_.front().step);
  const std::int64_t stride =
      watch_strain || !asked_.empty()
          ? 1
          : std::max<std::int64_t>(1, static_cast<std::int64_t>(steps / kLooksAtSprings));
  double shortest = HUGE_VAL;
  const auto watch = [&] {
    courses.look(shadow);
    const Pinch near = nearest_pinch(shadow, static_cast<double>(stride) * shadow.h());
    shortest = std::min(shortest, near.share);
    if (near.margin < result.pinch.margin) {
      result.pinch = near;
      result.pinched_at = shadow.t();
    }
    if (!watch_strain) return;
    const StrainedSpring worst = worst_spring(shadow);
    if (worst.a >= 0 && !(std::abs(worst.strain) <= std::abs(result.strain.strain)))
      result.strain = worst;
  };
  const bool watches = run_->second_order() || !asked_.empty();
  courses.look(shadow);
  for (std::size_t k = 1; k < frames_.size(); ++k) {
    if (!take(shadow, finer, k, stop, watches ? watch : std::function<void()>(), stride)) {
      const bool stopped = stop() || shadow.divergence().status == StepStatus::kStopped;
      result.outcome = stopped ? Parting::Outcome::kStopped : Parting::Outcome::kShadowFailed;
      return result;
    }
    compare_frame(frames_[k], factor, shadow, result);
    path.push_back(places(shadow));
  }
  for (const double figure : courses.figures()) result.figures.push_back({figure});
  result.outcome = Parting::Outcome::kCompared;
  // A spring that is pressed to a point may leave it on either side.
  constexpr double kPressed = 0.1;  // of its rest length
  if (result.share > Parting::kWrong || shortest < kPressed) look_for_chaos(path, stop, result);
  const double known = std::max(result.error, Parting::kNeighbour * size_at(frames_.front()));
  if (!(Parting::kWrong * result.pinch.margin < known)) result.pinched_at = std::nan("");
  if (spread && result.chaotic()) ask_neighbours(stop, result);
  look_for_pulses(shadow, result);
  return result;
}

std::optional<std::vector<double>> Shadow::run_neighbour(int which,
                                                         const std::function<bool()>& stop,
                                                         const AtFrame& at_frame) const {
  double finer = 1;
  Simulation neighbour = finer_run(finer);
  neighbour.stop_when(stop);
  const double size = usual_size();
  const int count = run_->flat() ? run_->components() : run_->particles();
  Noise noise;
  for (int skipped = 0; skipped < 3 * count * which; ++skipped) noise.next();
  const double far = Parting::kNeighbour * size;
  for (int i = 0; i < count; ++i) {
    if (run_->flat()) {
      neighbour.set_component(i, neighbour.component(i) + far * noise.next());
    } else if (!run_->second_order() || !neighbour.pinned(i)) {
      const Vec3 away(noise.next(), noise.next(), noise.next());
      neighbour.set_position(i, neighbour.position(i) + far * away);
    }
  }
  Courses courses(asked_);
  courses.look(neighbour);
  at_frame(neighbour, 0);
  const auto follow = [&] { courses.look(neighbour); };
  for (std::size_t k = 1; k < frames_.size(); ++k) {
    if (!take(neighbour, finer, k, stop, asked_.empty() ? std::function<void()>() : follow))
      return {};
    at_frame(neighbour, k);
  }
  return courses.figures();
}

// A neighbour takes the steps of the shadow: how far they part over how far apart they began is the
// growth of a disturbance (Lyapunov 1892).
void Shadow::look_for_chaos(std::span<const std::vector<double>> path,
                            const std::function<bool()>& stop, Parting& result) const {
  const double size = usual_size();
  constexpr double kMostRate = 700;  // 1/s, of what exp() can tell
  std::vector<double> growths;
  double most = 0, apart = 0;
  run_neighbour(0, stop, [&](Simulation& other, std::size_t k) {
    const double distance = largest_distance(path[k], places(other), run_->flat());
    if (k == 0) apart = distance;
    if (k == 0 || !(apart > 0)) return;
    const double growth = distance / apart;
    // The rate is that of growth, until the distance is as large as the scene lets it be.
    if (most * apart < 0.01 * size)
      result.rate =
          std::exp(std::min(kMostRate, std::log(growth) / (frames_[k].t - frames_.front().t)));
    most = std::max(most, growth);
    growths.push_back(growth);
  });
  if (!(apart > 0)) return;
  // A jump that comes a little later parts neighbours while it lasts; chaos does not end.
  constexpr std::size_t kStays = 3;
  const std::size_t stays = std::min(kStays, growths.size());
  result.growth = std::isnan(result.growth) ? 0 : result.growth;
  for (std::size_t k = 0; k < growths.size(); ++k) {
    const auto from =
        growths.begin() + static_cast<std::ptrdiff_t>(std::min(k, growths.size() - stays));
    const double growth = *std::min_element(from, from + static_cast<std::ptrdiff_t>(stays));
    result.growth = std::max(result.growth, growth);
    if (Parting::kNeighbour * growth > Parting::kWrong && result.horizon == HUGE_VAL)
      result.horizon = frames_[k + 1].t;
  }
}

// Two chaotic runs may observe the same by chance.
void Shadow::ask_neighbours(const std::function<bool()>& stop, Parting& result) const {
  if (result.observed.empty()) return;
  const std::vector<double>& own = frames_.back().observed;
  for (int which = 1; which <= kNeighbours; ++which) {
    std::vector<double> observed;
    const auto figures = run_neighbour(which, stop, [&](Simulation& neighbour, std::size_t k) {
      if (k + 1 == frames_.size()) observed = spec_->observe(neighbour);
    });
    if (!figures) return;
    for (std::size_t i = 0; i < own.size(); ++i) {
      double& most = result.observed[i].neighbours;
      if (const double off = std::abs(own[i] - observed[i]); !(off <= most)) most = off;
    }
    for (std::size_t i = 0; i < figures->size(); ++i)
      result.figures[i].neighbours.push_back((*figures)[i]);
  }
}

}  // namespace sim::study
