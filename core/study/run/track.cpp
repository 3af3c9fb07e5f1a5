#include "core/study/run/track.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/text.h"
#include "core/study/run/divergence_text.h"

namespace sim::study {
namespace {

// The fastest particle, as the source of an energy without bounds.
int fastest_particle(const Simulation& system) {
  int fastest = 0;
  double most = -1;
  for (int i = 0; i < system.particles(); ++i) {
    const double speed = system.velocity(i).cwiseAbs().maxCoeff();
    if (speed > most) {
      most = speed;
      fastest = i;
    }
  }
  return fastest;
}

std::int64_t to_next(std::int64_t step, std::int64_t stride) { return stride - step % stride; }

// Sudden effects, such as fast modes that die out, are sampled after 1, 2, 4, 8, ... steps.
bool is_early(std::int64_t taken) { return taken > 0 && (taken & (taken - 1)) == 0; }
std::int64_t to_early(std::int64_t taken) {
  std::int64_t next = 1;
  while (next <= taken) next *= 2;
  return next - taken;
}

}  // namespace

Track::Track(const SystemSpec& spec, Simulation& system, std::int64_t steps,
             std::int64_t frame_stride, std::int64_t row_stride, Registry* registry)
    : spec_(&spec),
      system_(&system),
      steps_(steps),
      frame_stride_(frame_stride),
      row_stride_(row_stride),
      first_step_(system.step_count()),
      sampled_(first_step_),
      looks_(first_step_, steps),
      first_t_(system.t()),
      monitor_(spec, system, steps - system.step_count(), registry) {
  if (registry) shadow_.emplace(spec, system, steps - system.step_count(), *registry);
  if (system.second_order()) start_ = energy();
  if (has_exact()) deviation();
}

int Track::advance(std::int64_t most) {
  if (const auto end = cut()) return system_->step_to(*end) ? 1 : 0;
  return system_->steps(end_ ? std::min(most, steps_ - system_->step_count() - 1) : most);
}

std::optional<double> Track::cut() const {
  return steps_ - system_->step_count() == 1 ? end_ : std::nullopt;
}

void Track::end_at(double time) {
  end_ = time;
  short_ = time - system_->t(steps_ - 1);
}

std::optional<double> Track::short_step() const { return short_; }

bool Track::began_anew() const { return finished() && keeps_steps_; }

std::span<const double> Track::observed() {
  if (observed_step_ != system_->step_count()) {
    observed_ = spec_->observe(*system_);
    observed_step_ = system_->step_count();
  }
  return observed_;
}

void Track::judge(const std::vector<Quantity>& figures) {
  judged_ = figures;
  courses_.resize(figures.size());
  if (shadow_) shadow_->judge(figures);
}

double Track::figure_parted(std::size_t i) const {
  return i < parting_.figures.size() ? std::abs(figure(i) - parting_.figures[i].shadow)
                                     : std::nan("");
}

double Track::figure_spread(std::size_t i) const {
  double most = std::nan("");
  if (i < parting_.figures.size())
    for (const double each : parting_.figures[i].neighbours) {
      const double off = std::abs(figure(i) - each);
      if (std::isnan(off)) return off;
      if (!(off <= most)) most = off;
    }
  return most;
}

bool Track::take(std::int64_t& taken, std::int64_t stride, bool last) {
  const std::int64_t step = system_->step_count();
  if (taken == step || !(last || step % stride == 0 || step == steps_)) return false;
  taken = step;
  return true;
}

void Track::sample() {
  const std::int64_t step = system_->step_count();
  if (step > sampled_) monitor_.advance(step - sampled_);
  sampled_ = step;
  looked_ = false;
  if (cut())
    keeps_steps_ = !system_->integrator_info().adaptive && !system_->integrator().memory().empty();
  for (std::size_t i = 0; i < judged_.size(); ++i)
    courses_[i].look(system_->t(), judged_[i].at(*system_));
  const bool due = looks_.take(step);
  if (!due && !(shadow_ && is_early(step - first_step_))) return;
  const Energy* const now = system_->second_order() ? &energy() : nullptr;
  if (now && !energy_is_finite()) return;
  if (due) {
    monitor_.look(now);
    looked_ = true;
  }
  if (shadow_) shadow_->look(now, observed());
}

std::int64_t Track::due() const {
  const std::int64_t step = system_->step_count();
  if (!judged_.empty()) return 1;
  return std::min({to_next(step, frame_stride_), to_next(step, row_stride_),
                   std::max<std::int64_t>(1, looks_.next() - step), to_early(step - first_step_),
                   steps_ - step, monitor_.due()});
}

bool Track::energy_is_finite() {
  if (std::isfinite(energy().kinetic) && std::isfinite(energy().total())) return true;
  if (system_->step_count() == 0) energy_unknown_ = true;
  if (diverged_.empty() && !energy_unknown_)
    diverged_ = "the energy is not a finite number from " +
                step_place(system_->step_count(), system_->t(), system_->h()) +
                " on (fastest: particle " + std::to_string(fastest_particle(*system_)) + ")";
  return false;
}

const Energy& Track::energy() {
  if (energy_step_ != system_->step_count()) {
    energy_ = system_->energy();
    energy_step_ = system_->step_count();
  }
  return energy_;
}

void Track::mark_diverged() { mark_diverged(divergence_text(*spec_, *system_)); }

void Track::mark_diverged(std::string why) {
  stuck_ = true;
  diverged_ = std::move(why);
}

void Track::continue_from(double total, std::span<const double> work) {
  if (!system_->second_order()) return;
  if (work.empty() || !monitor_.recall_work(work)) return;  // from here, then
  set_start(total);
}

void Track::touched(double energy) {
  monitor_.touched(energy);
  start_.potential += energy;
  energy_step_ = observed_step_ = -1;
  leave_unverified("positions not verified: hands were in it");
}

bool Track::verify_beside(const std::function<bool()>& stop, bool early) {
  return shadow_ && !verified_before_ && shadow_->follow_beside(stop, early);
}

void Track::verify(const std::function<bool()>& stop, ComparisonEffort effort) {
  if (!shadow_ || !diverged_.empty() || energy_unknown_ || interrupted_) return;
  if (verified_before_)
    shadow_->look_for_pulses(parting_, allowed_);
  else
    parting_ = shadow_->compare(stop, effort);
}

void Track::verified_by(study::RunDeviation parting, double allowed) {
  parting_ = std::move(parting);
  allowed_ = allowed;
  verified_before_ = true;
}

void Track::leave_unverified(std::string why) {
  if (shadow_) unverified_ = std::move(why);
  shadow_.reset();
}

Verdict Track::verdict() {
  if (!diverged_.empty()) return {Trust::kDiverged, diverged_};
  Verdict verdict = monitor_.verdict(parting_);
  if (verdict.trust == Trust::kTrusted) {
    const bool verified = parting_.verified() || has_exact();
    if (!verified && !unverified_.empty()) verdict.reason += "; " + unverified_;
    if (!verified || !doubt_.empty()) verdict.trust = Trust::kUnverified;
  }
  if (!doubt_.empty()) verdict.reason = doubt_ + "; " + verdict.reason;
  if (energy_unknown_)
    verdict = {Trust::kSuspect,
               "the energy is above the largest number from the start; nothing was checked"};
  if (interrupted_) {
    verdict.trust = Trust::kSuspect;
    verdict.reason = "interrupted at t = " + brief(system_->t()) + " s of " + brief(end()) + " s";
  } else if (steps_ == 0 && !energy_unknown_) {
    verdict.trust = doubt_.empty() ? Trust::kTrusted : Trust::kUnverified;
    verdict.reason = "the initial state, no step was taken";
  }
  return verdict;
}

Verdict overall_verdict(std::span<Track> tracks) {
  Verdict worst;
  for (Track& track : tracks) worst.trust = std::max(worst.trust, track.verdict().trust);
  for (Track& track : tracks) {
    const Verdict verdict = track.verdict();
    if (verdict.trust != worst.trust) continue;
    if (!worst.reason.empty()) worst.reason += "; ";
    if (tracks.size() > 1) worst.reason += track.system().name() + ": ";
    worst.reason += verdict.reason;
  }
  return worst;
}

}  // namespace sim::study
