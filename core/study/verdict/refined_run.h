// A refined run of a system from a state of its run on, sampled at the times of the run's samples.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/study/problem.h"
#include "core/study/verdict/strain.h"

namespace sim::study {

// The step and time of a sample of a run.
struct Moment {
  std::int64_t step = 0;
  double t = 0;  // s
};

// The stored part of a state.
struct Sight {
  std::vector<double> x;      // coordinates of all particles, or the numbers of a flat state
  double energy;              // J, total; not a number where it is not wanted
  std::vector<double> state;  // X, where it is wanted
  std::vector<int> broken;    // as in Settings
};

std::vector<double> positions(Simulation& system);  // Sight::x of the present state
std::vector<double> state_of(const Simulation& system);

class RefinedRun {
 public:
  struct Plan {
    double steps_per_step = 2;             // for each of the run's, with a sharper method too
    std::optional<MethodChoice> method{};  // instead of the sharper one
    std::int64_t stride = 0;               // steps between looks at figures and springs; 0: none
    std::vector<Quantity> figures{};       // judged; then the stride is 1
    bool springs = false;                  // springs that come to a point are searched for
    bool strain = false;                   // and how far they are stretched
    bool energy = false, states = false;   // kept, in each sight
    bool shifted = false;                  // steps end in between those of the run

    bool same_steps(const Plan& other) const {
      return steps_per_step == other.steps_per_step && stride == other.stride;
    }
  };

  // Refines a run with these settings that is at X = x. Spec and registry outlive it.
  RefinedRun(const SystemSpec& spec, Registry& registry, const Settings& own, const Moment& begin,
             std::span<const double> x, Plan plan);

  Simulation& system() { return system_; }
  const Simulation& system() const { return system_; }
  const Plan& plan() const { return plan_; }

  // Advances to the next sample of the run. False if a step fails or `stop` says so; it may
  // continue then.
  bool follow(const Moment& to, const std::function<bool()>& stop);
  const std::vector<Sight>& path() const { return path_; }  // at each moment it followed to
  std::vector<double> figures() const;
  const StrainedSpring& strain() const { return strain_; }  // worst seen
  const Pinch& pinch() const { return pinch_; }             // narrowest seen
  double pinched_at() const { return pinched_at_; }         // s
  double shortest() const { return shortest_; }             // spring, of its rest length

 private:
  bool run(double steps, const std::function<bool()>& stop);
  bool follow_between(const Moment& to, const std::function<bool()>& stop);
  void record();
  void look();
  void look_at_figures();

  Simulation system_;
  Plan plan_;
  double h_;  // s, of the run
  Moment now_;
  std::vector<Sight> path_;
  std::vector<Course> courses_;
  StrainedSpring strain_;
  Pinch pinch_;
  double pinched_at_ = std::nan(""), shortest_ = HUGE_VAL;
};

}  // namespace sim::study
