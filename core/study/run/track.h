// The track of one system through a run: its length, and the times of its measurements.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/scene/simulation.h"
#include "core/study/verdict/sampling_schedule.h"
#include "core/study/verdict/verdict.h"

namespace sim::study {

class Track {
 public:
  static constexpr double kQuick = 1;  // s: a run that takes less has its shadow always
  static constexpr std::int64_t kNever = INT64_MAX;  // a stride

  // Spec and system outlive it. 0 steps are legal; tables have a frame every `frame_stride` steps,
  // reports a row every `row_stride`, both at the start and at the end too. Throws the errors of
  // the exact solution at t = 0. The registry is for the verdict, see Monitor.
  Track(const SystemSpec& spec, Simulation& system, std::int64_t steps, std::int64_t frame_stride,
        std::int64_t row_stride, Registry* registry = nullptr);
  void set_start(double total) { start_ = {0, total}; }  // the drift counts from that, in J
  void end_at(double time);                         // the last step ends there, before its own end
  void end_anywhere() { monitor_.end_anywhere(); }  // at any step: what happens ends it
  int advance(std::int64_t most);     // as Simulation::steps, with the last one shortened
  std::optional<double> cut() const;  // s, where the next step has to end, if that is a shorter one
  void continue_from(double total, std::span<const double> work);  // that of a first part, if known
  std::vector<double> work_memory() const { return monitor_.work_memory(); }
  void touched(double energy);  // by a user, with so many J; there is no refined run then
  Simulation& system() const { return *system_; }
  std::int64_t steps() const { return steps_; }
  std::int64_t frame_stride() const { return frame_stride_; }
  std::int64_t row_stride() const { return row_stride_; }
  std::int64_t taken() const { return system_->step_count() - first_step_; }
  double elapsed() const { return system_->t() - first_t_; }        // s, simulated
  double end() const { return end_ ? *end_ : system_->t(steps_); }  // s
  std::optional<double> short_step() const;  // the size of the last step, where it is shortened, s
  bool began_anew() const;                   // for it, as the method keeps earlier ones
  bool finished() const { return system_->step_count() >= steps_; }
  bool has_exact() const { return static_cast<bool>(spec_->exact); }
  // True if the present state is due: once a step, and for the `last` one of a run that stops
  // early.
  bool take_frame(bool last) { return take(last_frame_, frame_stride_, last); }
  bool take_row(bool last) { return take(last_row_, row_stride_, last); }
  void sample();             // looks at energy and error about 100 times a run, unevenly
  std::int64_t due() const;  // steps until the next of all these, at least 1
  bool energy_is_finite();   // second order only; false, for the verdict too, when it is not
  const Energy& energy();    // of the present state
  const Energy& start_energy() const { return start_; }
  // The energy taken by drag since the start, J; not a number after forget_work().
  double work() const { return work_known_ ? monitor_.work() : std::nan(""); }
  void forget_work() { work_known_ = false; }
  double drift() { return energy().total() + work() - start_.total(); }  // J
  void judge(const std::vector<Quantity>& figures);  // of all steps; before the first
  std::span<const Quantity> judged() const { return judged_; }
  double figure(std::size_t i) const { return courses_[i].figure(judged_[i]); }
  double figure_parted(std::size_t i) const;  // from that of the shadow; not a number: not known
  double figure_spread(std::size_t i) const;  // from the neighbour's that is furthest; likewise
  std::span<const double> observed();         // of the present state; not finite: not known
  std::span<const ObserverSpec> observers() const { return spec_->observers; }
  std::span<const ObservedDeviation> parted() const { return parting_.observed; }  // of its shadow
  Deviation deviation() const { return study::deviation(*spec_, *system_); }
  // Runs the refined run, from now on beside it or at the end, as far as `stop` lets it:
  // StepDoubling.
  bool verify_beside(const std::function<bool()>& stop, bool early = false);
  bool verifies_beside() const { return shadow_ && shadow_->is_beside(); }
  void verify(const std::function<bool()>& stop, ComparisonEffort effort = {});
  bool verified() const { return parting_.verified(); }
  bool compared() const { return !std::isnan(parting_.error); }  // or a part of it
  // It was measured on a run of the same bits; pulses that move anything by more than `allowed`, m,
  // are still looked for.
  void verified_by(study::RunDeviation parting, double allowed);
  bool verified_before() const { return verified_before_; }
  double missed_pulse() const { return parting_.missed_at; }  // s; not a number: none is known
  bool chaotic() const { return parting_.chaotic(); }
  void leave_unverified(std::string why);  // there will be no shadow; the verdict says why
  void doubt_start(std::string why) { doubt_ = std::move(why); }  // see Account::doubt
  const std::string& doubt() const { return doubt_; }
  void mark_interrupted() { interrupted_ = true; }
  void mark_diverged();  // as the system's divergence() says; it takes no more steps
  void mark_diverged(std::string why);
  bool stuck() const { return stuck_; }
  bool diverges() const { return !diverged_.empty() || (!energy_unknown_ && monitor_.exploded()); }
  bool looked() const { return looked_; }  // at the present state
  bool sound() const { return diverged_.empty() && monitor_.sound(); }
  Verdict verdict();

 private:
  bool take(std::int64_t& taken, std::int64_t stride, bool last);
  const SystemSpec* spec_;
  Simulation* system_;
  std::int64_t steps_, frame_stride_, row_stride_, first_step_, sampled_;
  SamplingSchedule looks_;
  double first_t_;                                // s
  std::int64_t last_frame_ = -1, last_row_ = -1;  // steps they were taken at
  Energy start_, energy_;
  std::int64_t energy_step_ = -1, observed_step_ = -1;  // the steps that these belong to
  std::vector<double> observed_;
  std::vector<Quantity> judged_;
  std::vector<Course> courses_;
  std::optional<double> end_, short_;  // s, of a last step that is shortened: when, how long
  Monitor monitor_;
  std::optional<StepDoubling> shadow_;
  RunDeviation parting_;
  double allowed_ = HUGE_VAL;                  // see verified_by()
  std::string unverified_, diverged_, doubt_;  // why it has no shadow, why it diverged, see above
  bool looked_ = false, energy_unknown_ = false;  // beyond the range of numbers from the start
  bool keeps_steps_ = false, interrupted_ = false, work_known_ = true, stuck_ = false;
  bool verified_before_ = false;  // verified_by()
};

// The verdict on all systems of a run: the worst one's, with the names if there are several.
Verdict overall_verdict(std::span<Track> tracks);

}  // namespace sim::study
