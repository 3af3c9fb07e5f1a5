#include "core/study/verdict/step_doubling.h"

#include <algorithm>
#include <utility>

#include "core/base/finite.h"
#include "core/base/noise.h"
#include "core/math/elementary.h"
#include "core/math/median.h"
#include "core/particles/particle_system.h"
#include "core/particles/step_correction.h"
#include "core/study/accuracy/error_estimator.h"
#include "core/study/acted.h"
#include "core/study/problem.h"
#include "core/study/verdict/criterion.h"
#include "core/study/verdict/pulses.h"

namespace sim::study {
namespace {

constexpr std::size_t kMostFrames = 100, kMostNumbers = std::size_t{1} << 22;  // kept of a run
constexpr int kNeighbours = 3;             // runs that check observables in chaos
constexpr std::size_t kFewNumbers = 1000;  // of a flat state
constexpr double kLittle = 0.01;           // of the largest number of a run
constexpr int kFinestStates = 200;         // that an adaptive shadow shows, at least
constexpr double kInDoubt = 0.2;           // of the size: a run so far off is wrong

// The largest distance of a particle, or difference of a number of a flat state.
double largest_distance(std::span<const double> a, std::span<const double> b, bool flat) {
  double most = 0;
  const std::size_t width = flat ? 1 : 3;
  for (std::size_t i = 0; i < a.size(); i += width) {
    double square = 0;
    for (std::size_t k = i; k < i + width; ++k) square += (a[k] - b[k]) * (a[k] - b[k]);
    const double distance = std::sqrt(square);
    most = larger_error(distance, most);
  }
  return std::isnan(most) ? HUGE_VAL : most;
}

double largest_number(const std::vector<double>& numbers) {
  double most = 0;
  for (const double number : numbers) most = std::max(most, std::abs(number));
  return most;
}

// The largest extent of some points along an axis.
double extent(std::span<const double> points) {
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t i = axis; i < points.size(); i += 3) {
      low = std::min(low, points[i]);
      high = std::max(high, points[i]);
    }
    size = std::max(size, high - low);
  }
  return size;
}

// True if points are so far from those of the refined run that the run is in doubt whatever
// follows. The final travel of a single point is not known yet.
bool far_apart(std::span<const double> start, std::span<const double> run, const Sight& shadow) {
  const double size = std::max(extent(start), extent(run));
  return size > 0 && largest_distance(run, shadow.x, false) > kInDoubt * size;
}

}  // namespace

StepDoubling::StepDoubling(const SystemSpec& spec, Simulation& run, std::int64_t steps,
                           Registry& registry)
    : spec_(&spec),
      run_(&run),
      registry_(&registry),
      start_(run.snapshot()),
      start_steps_(run.integrator().effort().steps),
      last_step_(run.step_count() + steps) {
  const auto numbers = std::max<std::size_t>(1, run.state().size());
  const auto most = std::clamp<std::size_t>(kMostNumbers / numbers, 4, kMostFrames);
  constexpr std::int64_t kLooks = 100;
  stride_ = std::max<std::int64_t>(1, kLooks / static_cast<std::int64_t>(most));
  may_jump_ = may_have_pulses(run);
  given_motion_ = has_given_motion(run);
}

void StepDoubling::look(const Energy* energy, std::span<const double> observed) {
  if (energy) {
    if (frames_.empty()) start_potential_ = energy->potential;
    in_play_ = std::max(in_play_, energy->kinetic + std::abs(energy->potential - start_potential_));
  }
  if (looks_++ % stride_ != 0 && run_->step_count() != last_step_) return;
  frames_.push_back({{run_->step_count(), run_->t()},
                     {positions(*run_), energy ? energy->total() : std::nan(""),
                      may_jump_ || given_motion_ ? state_of(*run_) : std::vector<double>(),
                      run_->settings().broken},
                     0,
                     {observed.begin(), observed.end()}});
  if (run_->flat()) frames_.back().largest = largest_number(frames_.back().seen.x);
  if (beside_) beside_->look(frames_.back().at, frames_.back().seen.x);
}

// Two samples for each step of the method, also of one with steps inside ours, and more if steps
// are so few that two show no more.
double StepDoubling::steps_per_step(double steps) const {
  constexpr double kFewest = 64, kMost = 32;
  if (run_->integrator_info().adaptive)
    return std::clamp(std::ceil(kFinestStates / steps), 1.0, double(kFinestStates));
  const double inside = steps_inside();
  return 2 * inside * std::clamp(std::ceil(kFewest / (2 * inside * steps)), 1.0, kMost);
}

double StepDoubling::steps_inside() const {
  const auto taken = static_cast<double>(run_->step_count() - start_.step);
  const auto own = static_cast<double>(run_->integrator().effort().steps - start_steps_);
  if (run_->integrator_info().adaptive || !(taken > 0)) return 1;
  return std::max(1.0, std::round(own / taken));
}

// Springs are sampled in every step of an adaptive run, or else often enough to catch one that
// turns inside out.
RefinedRun::Plan StepDoubling::plan(double steps) const {
  constexpr double kLooksAtSprings = 2000;
  RefinedRun::Plan plan{.steps_per_step = steps_per_step(steps),
                        .figures = asked_,
                        .springs = run_->second_order(),
                        .energy = run_->second_order(),
                        .states = !spec_->observers.empty()};
  plan.strain = plan.springs && run_->integrator_info().adaptive && plan.steps_per_step > 1;
  if (plan.strain || !asked_.empty())
    plan.stride = 1;
  else if (plan.springs)
    plan.stride = std::max<std::int64_t>(
        1, static_cast<std::int64_t>(plan.steps_per_step * steps / kLooksAtSprings));
  return plan;
}

RefinedRun StepDoubling::make_refined_run(RefinedRun::Plan plan) const {
  Settings own = run_->settings();
  own.broken = start_.settings->broken;
  own.broken_energy = start_.settings->broken_energy;
  return {*spec_, *registry_, own, {start_.step, start_.t()}, start_.x, std::move(plan)};
}

bool StepDoubling::follow_beside(const std::function<bool()>& stop, bool early) {
  if (spec_->one_thread || !run_->second_order() || !asked_.empty() || frames_.empty())
    return false;
  RefinedRun shadow = make_refined_run(plan(static_cast<double>(last_step_ - start_.step)));
  shadow.system().stop_when(stop);
  const std::span<const double> start = frames_.front().seen.x;
  beside_ = std::make_unique<RefinedRunThread>(
      std::move(shadow), stop, [start, early](std::span<const double> run, const Sight& seen) {
        return early && far_apart(start, run, seen);
      });
  for (std::size_t k = 1; k < frames_.size(); ++k) beside_->look(frames_[k].at, frames_[k].seen.x);
  return true;
}

// The refined run already begun, if its plan was that of the whole run.
RefinedRun StepDoubling::take_shadow(const RefinedRun::Plan& plan) {
  if (beside_) {
    std::optional<RefinedRun> begun = std::exchange(beside_, nullptr)->take();
    if (begun && begun->plan().same_steps(plan)) return std::move(*begun);
  }
  return make_refined_run(plan);
}

// The extent of the scene, then or at the start; of a single point its travel in the run; of
// numbers the largest or, if that is near 0, its usual size or a share of its later size.
double StepDoubling::size_at(const Frame& frame) const {
  const Frame& first = frames_.front();
  double size = 0;
  if (run_->flat()) {
    std::vector<double> sizes{0};
    if (first.seen.x.size() <= kFewNumbers)
      for (const Frame& each : frames_) sizes.push_back(each.largest);
    return std::max(
        {first.largest, frame.largest, median(sizes), kLittle * *std::ranges::max_element(sizes)});
  }
  size = std::max(extent(first.seen.x), extent(frame.seen.x));
  if (size > 0) return size;
  for (const Frame& each : frames_)
    size = std::max(size, largest_distance(each.seen.x, first.seen.x, false));
  if (!run_->second_order())
    size = std::max(size,
                    largest_distance(frame.seen.x, std::vector(frame.seen.x.size(), 0.0), false));
  return size;
}

double StepDoubling::usual_size() const {
  const double start = size_at(frames_.front());
  return start > 0 ? start : size_at(frames_.back());
}

double StepDoubling::take_error(double error, const Frame& frame, RunDeviation& result) const {
  const double size = size_at(frame);
  const double share = size > 0 ? error / size : error > 0 ? HUGE_VAL : 0;
  if (!(error <= result.error)) result.error = error;
  if (!(share <= result.share)) result.share = share;
  if (share > RunDeviation::kWrong) result.horizon = std::min(result.horizon, frame.at.t);
  return size;
}

void StepDoubling::compare_frame(std::size_t k, double factor, std::span<const Sight> shadow,
                                 RunDeviation& result) const {
  const Frame& frame = frames_[k];
  const double distance = largest_distance(frame.seen.x, shadow[k - 1].x, run_->flat());
  result.at_end = factor * distance;
  const double size = take_error(result.at_end, frame, result);
  const double moved = largest_distance(frame.seen.x, frames_.front().seen.x, run_->flat());
  if (!run_->second_order() || !(in_play_ > 0)) return;
  if (moved <= at_rest(run_->integrator_info()) * size) return;
  const double own = frame.seen.energy, other = shadow[k - 1].energy;
  double low = other, high = other;
  if (acts_between_steps(*run_)) {
    // A body that stands on something trembles within the tolerance of contact.
    constexpr double kFaint = 1e-6, kTrembles = 10;
    if (moved <= std::min(kFaint * size, kTrembles * distance)) return;
    // An impact that comes a moment sooner or later takes its energy then.
    for (const double near : {k > 1 ? shadow[k - 2].energy : frames_.front().seen.energy,
                              k < shadow.size() ? shadow[k].energy : other}) {
      low = std::min(low, near);
      high = std::max(high, near);
    }
  }
  const double off = std::isnan(other) ? other
                     : own < low       ? low - own
                     : own > high      ? own - high
                                       : 0;
  if (!(off / in_play_ <= result.energy)) result.energy = off / in_play_;
}

// A tie that breaks a step later still breaks: what counts is the final state, and since when.
void StepDoubling::compare_broken(const RefinedRun& shadow, RunDeviation& result) const {
  for (std::size_t k = shadow.path().size(); k > 0; --k) {
    if (frames_[k].seen.broken == shadow.path()[k - 1].broken) return;
    result.others_broke_at = frames_[k].at.t;
    result.horizon = std::min(result.horizon, frames_[k].at.t);
  }
}

// Ties break at the ends of steps, and there contact that began in them goes on as rest, opens, or
// holds: two runs with ends in common may do so at the same moment, late by up to a step. The run
// with steps that end in between does it half a step sooner or later, so that twice its distance is
// the error of a whole one. Steps of adaptive methods end at impacts, as well as these are located.
void StepDoubling::compare_shifted(std::size_t frames, const std::function<bool()>& stop,
                                   RunDeviation& result) const {
  constexpr double kLocated = 1e-7;  // m, in units of the place: what the tolerance of gaps becomes
  const bool broke = run_->settings().broken != start_.settings->broken;
  const bool adaptive = run_->integrator_info().adaptive;
  const Acted acted = contact_of(*run_);
  if (acted.colliders && adaptive)
    result.error =
        std::max(result.error, kLocated * std::max(1.0, largest_number(frames_.back().seen.x)));
  if (!broke && !acted.at_ends(adaptive)) return;
  RefinedRun shifted = make_refined_run(
      {.steps_per_step = 1, .method = run_->settings().method.choice(), .shifted = true});
  if (!follow(shifted, frames, stop)) {
    // A run that is wrong stays so; one that is right is known as far as both others got.
    const bool wrong = result.share > result.allowed;
    const std::size_t known = wrong ? frames - 1 : shifted.path().size();
    result.outcome = RunDeviation::Outcome::kStopped;
    result.until = known > 0 ? std::min(result.until, frames_[known].at.t) : HUGE_VAL;
  }
  for (std::size_t k = 1; k <= shifted.path().size(); ++k) {
    const double error =
        2 * largest_distance(frames_[k].seen.x, shifted.path()[k - 1].x, run_->flat());
    take_error(error, frames_[k], result);
    if (k + 1 == frames_.size()) result.at_end = std::max(result.at_end, error);
  }
  compare_broken(shifted, result);
}

std::vector<double> StepDoubling::observe(RefinedRun& shadow, std::size_t frame) const {
  Simulation& system = shadow.system();
  Snapshot then = system.snapshot();
  then.step = then.n0 = 0;
  then.t0 = frames_[frame].at.t;
  then.x = shadow.path()[frame - 1].state;
  then.memory = {};
  if (system.breaks()) {
    auto own = std::make_shared<Settings>(*then.settings);
    own->broken = shadow.path()[frame - 1].broken;
    then.settings = std::move(own);
  }
  system.restore(then);
  return spec_->observe(system);
}

void StepDoubling::compare_observed(RefinedRun& shadow, RunDeviation& result) const {
  if (frames_.back().observed.empty()) return;  // none, or looked at without them
  result.observed.resize(spec_->observers.size());
  for (std::size_t k = 1; k <= shadow.path().size(); ++k) {
    const std::vector<double> observed = observe(shadow, k);
    for (std::size_t i = 0; i < observed.size(); ++i) {
      ObservedDeviation& parted = result.observed[i];
      parted.at_end = std::abs(frames_[k].observed[i] - observed[i]);
      if (!(parted.at_end <= parted.most)) parted.most = parted.at_end;
    }
  }
}

bool StepDoubling::follow(RefinedRun& shadow, std::size_t frames,
                          const std::function<bool()>& stop) const {
  shadow.system().stop_when(stop);
  while (shadow.path().size() + 1 < frames)
    if (!shadow.follow(frames_[shadow.path().size() + 1].at, stop)) return false;
  return true;
}

bool StepDoubling::follow_until_far(RefinedRun& shadow, const std::function<bool()>& stop) const {
  const std::vector<double>& start = frames_.front().seen.x;
  for (std::size_t k = shadow.path().size();; ++k) {
    if (k > 0 && far_apart(start, frames_[k].seen.x, shadow.path()[k - 1])) return true;
    if (k + 1 == frames_.size()) return true;
    if (!follow(shadow, k + 2, stop)) return false;
  }
}

RunDeviation StepDoubling::compare(const std::function<bool()>& stop, ComparisonEffort effort) {
  RunDeviation result;
  if (frames_.size() < 2) return result;
  const RefinedRun::Plan plan = this->plan(double(frames_.back().at.step - start_.step));
  RefinedRun shadow = take_shadow(plan);
  result.outcome = RunDeviation::Outcome::kCompared;
  const bool early = effort.early && run_->second_order();
  if (!(early ? follow_until_far(shadow, stop) : follow(shadow, frames_.size(), stop))) {
    const bool stopped = stop() || shadow.system().divergence().status == StepStatus::kStopped;
    result.outcome =
        stopped ? RunDeviation::Outcome::kStopped : RunDeviation::Outcome::kShadowFailed;
    if (!stopped || shadow.path().empty()) return result;
  }
  const std::size_t seen = shadow.path().size();
  if (seen + 1 < frames_.size()) result.until = frames_[seen].at.t;
  const double factor = error_factor(shadow, stop);
  for (std::size_t k = 1; k <= seen; ++k) compare_frame(k, factor, shadow.path(), result);
  compare_broken(shadow, result);
  compare_shifted(seen + 1, stop, result);
  compare_observed(shadow, result);
  for (const double figure : shadow.figures()) result.figures.push_back({figure});
  result.strain = shadow.strain();
  result.pinch = shadow.pinch();
  // A spring that is compressed to a point may leave it on either side.
  if (result.share > RunDeviation::kWrong || shadow.shortest() < Pinch::kNear)
    look_for_chaos(shadow, stop, result);
  const double known = std::max(result.error, RunDeviation::kNeighbour * size_at(frames_.front()));
  if (RunDeviation::kWrong * result.pinch.margin < known) result.pinched_at = shadow.pinched_at();
  if (effort.spread && result.until == HUGE_VAL && result.chaotic()) ask_neighbours(stop, result);
  if (result.until == HUGE_VAL) look_for_pulses(shadow.system(), HUGE_VAL, result);
  return result;
}

// A run with twice the step, or ten times the tolerance: its distance from this run and from the
// refined run at the same states. Empty if that fails, as for an unstable coarser run.
std::optional<StepDoubling::Differences> StepDoubling::coarser(
    const RefinedRun& shadow, const std::function<bool()>& stop) const {
  const bool adaptive = run_->integrator_info().adaptive;
  RefinedRun::Plan plan{
      .steps_per_step = adaptive ? 1 : 0.5,
      .method = adaptive ? looser(run_->settings().method) : run_->settings().method.choice()};
  if (!plan.method || steps_inside() > 1) return {};
  RefinedRun run = make_refined_run(std::move(plan));
  run.system().stop_when(stop);
  Differences found;
  for (std::size_t k = 1; k <= shadow.path().size(); ++k) {
    const Frame& frame = frames_[k];
    const std::int64_t steps = frame.at.step - start_.step;
    const double h = run_->settings().h;
    const bool cut = frame.at.t < start_.t() + (static_cast<double>(steps) - 1e-6) * h;
    const auto distance = [&](const Sight& seen) {
      return largest_distance(frame.seen.x, seen.x, run_->flat());
    };
    const double finer = distance(shadow.path()[k - 1]);
    found.anywhere = std::max(found.anywhere, finer);
    if (!adaptive && (steps % 2 != 0 || cut)) continue;
    if (!run.follow(frame.at, stop)) return {};
    found.coarser = std::max(found.coarser, distance(run.path().back()));
    found.finer = std::max(found.finer, finer);
  }
  const bool near = std::max(found.coarser, found.finer) < size_at(frames_.front());
  return found.finer > 0 && near ? std::optional(found) : std::nullopt;
}

// err = C h^p, or C tol^p: a run with c h differs from this one by err (c^p - 1), and the refined
// run with h / k by err (1 - k^-p) (Richardson 1911). p follows from both, at most the order of the
// method: friction or a kink lower it. A p near 0, for differences that do not shrink with the
// step, leaves a factor of kMostFactor. In contact C changes from step to step: either difference
// may be small by chance, so that the larger error counts, twice, and with a tolerance three times;
// if the second is much smaller, half the step of the refined run is tried as well. A tenth of its
// tolerance is tried likewise, as steps that grow only where that pays may be the same with that.
double StepDoubling::error_factor(const RefinedRun& shadow,
                                  const std::function<bool()>& stop) const {
  constexpr double kMostFactor = 4, kNearly = 0.75, kUnlikely = 3;
  const IntegratorInfo info = run_->integrator_info();
  const double by_chance = info.adaptive ? 3 : 2;
  const double finer = info.adaptive ? kSharper : shadow.plan().steps_per_step / steps_inside();
  const double coarser = info.adaptive ? kSharper : 2;
  const Acted contact = contact_of(*run_);
  const double order = info.adaptive || contact.with_order_one ? 1 : std::max(1, info.order);
  const auto factor = [&](double p) { return 1 / (1 - elementary::pow(finer, -p)); };
  const auto ratio = [&](double p) { return (elementary::pow(coarser, p) - 1) * factor(p); };
  if (info.precision == Precision::kSingle) return factor(order);  // rounding has no order

  const std::optional<Differences> seen = this->coarser(shadow, stop);
  if (!seen) return contact.any ? kMostFactor : factor(order);
  const double far = seen->coarser / seen->finer;
  double low = -elementary::log(1 - 1 / kMostFactor) / elementary::log(finer), high = order;
  // A run that is nearly of its order has steps slightly too long for the theory.
  if (far > ratio(kNearly * order)) low = high;
  constexpr int kBisections = 30;
  for (int i = 0; i < kBisections && low < high; ++i) {  // the ratio grows with p
    const double p = 0.5 * (low + high);
    (ratio(p) < far ? low : high) = p;
  }
  const bool unlikely = far > kUnlikely * ratio(order);
  if (!contact.any && !(unlikely && info.adaptive)) return factor(low);
  const double told = contact.any ? std::min(by_chance * factor(low), kMostFactor) : factor(low);
  if (!unlikely)
    return std::max(
        told, by_chance * seen->coarser / seen->anywhere / (elementary::pow(coarser, low) - 1));
  RefinedRun::Plan finer_still{.steps_per_step = 2 * shadow.plan().steps_per_step};
  if (!contact.any) finer_still.method = sharper(shadow.system().settings().method);
  RefinedRun finest = make_refined_run(std::move(finer_still));
  follow(finest, shadow.path().size() + 1, stop);
  double most = seen->anywhere;
  for (std::size_t k = 1; k <= finest.path().size(); ++k)
    most =
        std::max(most, largest_distance(frames_[k].seen.x, finest.path()[k - 1].x, run_->flat()));
  return told * most / seen->anywhere;
}

RefinedRun StepDoubling::neighbour(int which) const {
  RefinedRun::Plan plan = this->plan(double(frames_.back().at.step - start_.step));
  plan.springs = plan.strain = plan.energy = false;
  plan.stride = plan.figures.empty() ? 0 : 1;
  RefinedRun run = make_refined_run(std::move(plan));
  Simulation& neighbour = run.system();
  const double size = usual_size();
  const int count = run_->flat() ? run_->components() : run_->particles();
  Noise noise;
  for (int skipped = 0; skipped < 3 * count * which; ++skipped) noise.next();
  const double far = RunDeviation::kNeighbour * size;
  for (int i = 0; i < count; ++i) {
    if (run_->flat()) {
      neighbour.set_component(i, neighbour.component(i) + far * noise.next());
    } else if (!run_->second_order() || !neighbour.pinned(i)) {
      const Vec3 away(noise.next(), noise.next(), noise.next());
      neighbour.set_position(i, neighbour.position(i) + far * away);
    }
  }
  return run;
}

// A neighbour takes the steps of the refined run: their final distance over their initial one is
// the growth of a disturbance (Lyapunov 1892).
void StepDoubling::look_for_chaos(const RefinedRun& shadow, const std::function<bool()>& stop,
                                  RunDeviation& result) const {
  const double size = usual_size();
  constexpr double kMostRate = 700;  // 1/s, the range of exp()
  RefinedRun other = neighbour(0);
  const double apart =
      largest_distance(frames_.front().seen.x, positions(other.system()), run_->flat());
  if (!(apart > 0)) return;
  follow(other, shadow.path().size() + 1, stop);
  std::vector<double> growths;
  double most = 0;
  for (std::size_t k = 0; k < other.path().size(); ++k) {
    const double growth =
        largest_distance(shadow.path()[k].x, other.path()[k].x, run_->flat()) / apart;
    // The rate is that of exponential growth, until the distance is limited by the size of the
    // scene.
    if (most * apart < 0.01 * size)
      result.rate = elementary::exp(std::min(
          kMostRate, elementary::log(growth) / (frames_[k + 1].at.t - frames_.front().at.t)));
    most = std::max(most, growth);
    growths.push_back(growth);
  }
  // A jump that comes slightly later separates neighbours while it lasts; chaos persists.
  constexpr std::size_t kStays = 3;
  const std::size_t stays = std::min(kStays, growths.size());
  result.growth = std::isnan(result.growth) ? 0 : result.growth;
  for (std::size_t k = 0; k < growths.size(); ++k) {
    const auto from =
        growths.begin() + static_cast<std::ptrdiff_t>(std::min(k, growths.size() - stays));
    const double growth = *std::min_element(from, from + static_cast<std::ptrdiff_t>(stays));
    result.growth = std::max(result.growth, growth);
    if (RunDeviation::kNeighbour * growth > RunDeviation::kWrong && result.horizon == HUGE_VAL)
      result.horizon = frames_[k + 1].at.t;
  }
  // A growth over three decades is extrapolated to the end of the run.
  constexpr double kExponential = 1e3;
  const Moment& begin = frames_.front().at;
  if (result.outcome == RunDeviation::Outcome::kCompared && result.until < HUGE_VAL &&
      result.growth > kExponential)
    result.growth =
        elementary::pow(result.growth, (frames_.back().at.t - begin.t) / (result.until - begin.t));
}

// Two chaotic runs may have the same observables by chance.
void StepDoubling::ask_neighbours(const std::function<bool()>& stop, RunDeviation& result) const {
  if (result.observed.empty()) return;
  const std::vector<double>& own = frames_.back().observed;
  for (int which = 1; which <= kNeighbours; ++which) {
    RefinedRun other = neighbour(which);
    if (!follow(other, frames_.size(), stop)) return;
    const std::vector<double> observed = observe(other, frames_.size() - 1);
    for (std::size_t i = 0; i < own.size(); ++i) {
      double& most = result.observed[i].neighbours;
      if (const double off = std::abs(own[i] - observed[i]); !(off <= most)) most = off;
    }
    const std::vector<double> figures = other.figures();
    for (std::size_t i = 0; i < figures.size(); ++i)
      result.figures[i].neighbours.push_back(figures[i]);
  }
}

}  // namespace sim::study
