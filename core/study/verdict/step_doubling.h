// Step doubling: the same run again with half the step, or a tenth of the tolerance; for a method
// of order p their difference is the error of the run up to a factor near 1.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/study/verdict/refined_run_thread.h"
#include "core/study/verdict/run_deviation.h"

namespace sim::study {

struct ComparisonEffort {
  // More neighbours, for observables and figures, if the motion is chaotic.
  bool spread = false;
  // Ends once the two are so far apart that the run is in doubt whatever follows.
  bool early = false;
};

// Stores states of a run while it goes on, to compare them with a refined run afterwards.
class StepDoubling {
 public:
  // Begins at the first state of a run of `steps` more steps; all arguments outlive it.
  StepDoubling(const SystemSpec& spec, Simulation& run, std::int64_t steps, Registry& registry);

  // Requests these figures of the whole refined run, from all its steps.
  void judge(std::span<const Quantity> figures) { asked_.assign(figures.begin(), figures.end()); }

  // Samples the present state, at intervals; `energy` in a second-order system only, `observed` the
  // values of the scene's observers.
  void look(const Energy* energy, std::span<const double> observed = {});

  // From now on the refined run follows the run on a thread of its own, in a system of particles
  // that calls no Lua and without figures; false otherwise. The result is the same.
  bool follow_beside(const std::function<bool()>& stop, bool early = false);
  bool is_beside() const { return beside_ != nullptr; }

  // Makes the refined run over the sampled states, or what is left of them, and a neighbour of the
  // run as well if the two diverge. Costs two to four times the run; in chaotic motion with its
  // spread, ten times. `stop` ends it: then the outcome is kStopped, and the result is that of the
  // states compared until then.
  RunDeviation compare(const std::function<bool()>& stop, ComparisonEffort effort = {});

  // Searches for forces and motions that depend on time alone and acted between all steps, as
  // compare() does, if they move anything by more than `allowed`.
  void look_for_pulses(RunDeviation& result, double allowed) const;

 private:
  struct Frame {
    Moment at;
    Sight seen;      // with its state, where forces or motions may be pulses
    double largest;  // of the numbers of a flat state
    std::vector<double> observed;
  };

  double steps_inside() const;  // that the method takes in one of ours
  // The steps of the refined run for each of a run of `steps` steps.
  double steps_per_step(double steps) const;
  RefinedRun::Plan plan(double steps) const;
  RefinedRun make_refined_run(RefinedRun::Plan plan) const;
  RefinedRun take_shadow(const RefinedRun::Plan& plan);
  // Follows the frames not seen yet, of the first so many.
  bool follow(RefinedRun& shadow, std::size_t frames, const std::function<bool()>& stop) const;
  // Likewise, but only until the two are far apart.
  bool follow_until_far(RefinedRun& shadow, const std::function<bool()>& stop) const;
  struct Differences {
    // The largest of a particle, m, or of a number: at the states of both, and of the finer
    // anywhere.
    double coarser = 0, finer = 0, anywhere = 0;
  };
  std::optional<Differences> coarser(const RefinedRun& shadow,
                                     const std::function<bool()>& stop) const;
  // The ratio of the error to the difference from the refined run, by the order that a coarser run
  // shows.
  double error_factor(const RefinedRun& shadow, const std::function<bool()>& stop) const;
  // Takes the error of frame k > 0, which is shadow[k - 1]; factor: error_factor().
  void compare_frame(std::size_t k, double factor, std::span<const Sight> shadow,
                     RunDeviation& result) const;
  // The observed values at a frame, to which the system of the refined run is set back.
  std::vector<double> observe(RefinedRun& shadow, std::size_t frame) const;
  void compare_observed(RefinedRun& shadow, RunDeviation& result) const;
  void compare_broken(const RefinedRun& shadow, RunDeviation& result) const;
  void compare_shifted(std::size_t frames, const std::function<bool()>& stop,
                       RunDeviation& result) const;
  // A run from a first state perturbed by 1e-7 of the size, differently for each number.
  RefinedRun neighbour(int which) const;
  void look_for_chaos(const RefinedRun& shadow, const std::function<bool()>& stop,
                      RunDeviation& result) const;
  void ask_neighbours(const std::function<bool()>& stop, RunDeviation& result) const;
  struct Pulse;
  double affordable() const;
  std::vector<Pulse> find_pulses(OdeSystem& system) const;
  void look_for_pulses(Simulation& shadow, double allowed, RunDeviation& result) const;
  struct Leap;
  std::vector<Leap> leaps_between_frames(Simulation& shadow) const;
  double moved_by(const Leap& leap, std::span<const double> masses) const;  // m
  void look_for_leaps(Simulation& shadow, double allowed, RunDeviation& result) const;
  // Records an error at that frame; returns the size of the scene there.
  double take_error(double error, const Frame& frame, RunDeviation& result) const;
  std::optional<std::vector<double>> resolved(std::size_t frame, int steps) const;
  double size_at(const Frame& frame) const;  // of the scene, m
  double usual_size() const;                 // at the start, or at the end where it is 0 there

  const SystemSpec* spec_;
  Simulation* run_;
  Registry* registry_;
  Snapshot start_;
  std::int64_t start_steps_;  // of the method itself
  std::int64_t last_step_;
  std::int64_t stride_;  // looks a frame
  std::int64_t looks_ = 0;
  std::vector<Frame> frames_;
  std::vector<Quantity> asked_;
  double in_play_ = 0, start_potential_ = 0;  // J
  bool may_jump_ = false;                     // f has parts that may depend on time
  bool given_motion_ = false;                 // of particles or colliders
  std::unique_ptr<RefinedRunThread> beside_;
};

}  // namespace sim::study
