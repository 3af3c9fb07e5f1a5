// The energy balance: gravity and springs conserve energy, damping takes it, others do work.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/study/problem.h"
#include "core/study/work_integral.h"

namespace sim::study {

// E(t) + W(t) - E(0), where W is the work taken by drag, damped springs and all non-conservative
// forces, the integral of their power, and the energy lost in contact, broken ties and sleeping
// islands, less that given by moving colliders; 0 for the exact motion.
class EnergyBalance {
 public:
  // Samples the present state of a second-order system, which outlives it. steps: of the run, if
  // known: non-conservative forces are sampled less often in long runs, as far as their work is
  // known then.
  explicit EnergyBalance(Simulation& system, std::int64_t steps = 0);

  // Called after steps, at most due() of them: in large systems not after every one, to save time.
  // More are allowed if states are not available; W is then less certain.
  void advance(std::int64_t steps = 1);
  std::int64_t due() const;  // steps until the present state is wanted again

  // Says that the run may end at any step: the work of forces is then sampled as in a short one.
  void end_anywhere();

  // Called after a user's action at the present state, which changed the energy by so many J at
  // once: that counts as the start; the user's pull from now on is work, like that of any force.
  void touched(double energy);

  void look() { look(system_->energy()); }  // at the present state
  void look(const Energy& now);             // ... whose energy is known

  bool has_drag() const { return damped_; }  // of particles or of springs, or forces do work
  bool has_work() const { return driven_ || !working_.empty(); }  // of other forces
  // The same, or motion that is given: of particles, rods or colliders.
  bool is_driven() const { return has_work() || moves_pinned_ || moved_by_colliders_; }
  double taken() const;  // W up to the present state, with that of earlier parts, J
  // The numbers from which W is continued later, bit for bit.
  std::vector<double> memory() const;
  bool recall(std::span<const double> memory);
  ContactWork contact() const;                                                 // J
  double uncertainty() const { return has_drag() ? work_.uncertainty() : 0; }  // of W, J

  double error() const { return error_; }      // J, of the largest size so far, with its sign
  double in_play() const { return in_play_; }  // largest kinetic energy + change of potential, J
  double rise() const { return rise_; }        // largest E - E(0), J

 private:
  double power() const;      // of the damping and of forces that do work, W
  double hands() const;      // taken by them, W
  double potential() const;  // that such forces add to E all the same, J
  // The power less what these forces do now, W, summed on from there.
  double less_work(double power, std::span<Force* const> forces) const;
  std::span<Force* const> acting() const;  // of working_, those that are not off
  void choose_stride();

  Simulation* system_;
  bool damped_ = false, confined_ = false, driven_ = false, kinematic_ = false;
  bool moves_pinned_ = false;  // by the user or along prescribed paths
  bool moved_by_colliders_ = false;
  mutable Array sums_;  // scratch of power()
  std::vector<Force*> working_;
  mutable std::vector<Force*> acting_;  // scratch
  double start_potential_ = 0;          // J
  Energy start_;
  std::int64_t steps_;                   // of the run; 0: not known
  std::int64_t stride_ = 1, since_ = 0;  // steps, and those since the last look at the power
  std::int64_t least_ = 1, most_ = 1;    // that stride_ may be
  WorkIntegral work_;
  ContactWork contact_before_;  // minus its value at the start, J
  double broken_before_ = 0;    // J, in ties that were broken at the start
  double slept_before_ = 0;     // J, that falling asleep had taken then
  double before_ = 0;           // W of an earlier part of the run, J
  double error_ = 0, in_play_ = 0, rise_ = 0;
};

}  // namespace sim::study
