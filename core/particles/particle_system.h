// Particles with masses under forces, as a first-order system X' = f(t, X), X = (q, v).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/base/array.h"
#include "core/base/team.h"
#include "core/ode/ode_system.h"
#include "core/particles/explicit/sweep.h"
#include "core/particles/force.h"
#include "core/particles/layout.h"
#include "core/particles/springs/net_forces.h"

namespace sim {

// q' = v, v' = F(t, q, v) / m + g - (c / m) v, with g and c summed over the affine forces. A pinned
// particle has infinite mass: its velocity and acceleration are zero.
class ParticleSystem final : public OdeSystem {
 public:
  // masses in kg, n of them; pinned ids in any order; forces are bound to `initial`, a state in
  // this layout, which must have zero velocities where pinned.
  ParticleSystem(const std::vector<double>& masses, const std::vector<int>& pinned,
                 std::vector<std::unique_ptr<Force>> forces, const double* initial, Team& team);

  // Other masses and pins for the same particles and forces; steppers have to be made again.
  void set_masses(const std::vector<double>& masses, const std::vector<int>& pinned);

  const Layout& layout() const noexcept { return layout_; }
  const std::vector<std::unique_ptr<Force>>& forces() const noexcept { return forces_; }
  int pinned_count() const noexcept { return pinned_count_; }
  ParticleView view(double t, const double* state) const;

  // Springs and forces m g only: the total energy is constant.
  bool conserves_energy() const noexcept { return motion_.damping == 0 && other_forces_.empty(); }
  double kinetic_energy(double t, const double* state) const;    // J
  double potential_energy(double t, const double* state) const;  // J
  double elastic_energy(double t, const double* state) const;    // J, of the springs alone

  // W, that drag and dashpots take; sums: three coordinates a particle, for use on the way.
  double damping_power(double t, const double* state, Array& sums) const;
  bool has_damping() const noexcept { return motion_.damping > 0 || has_dashpots_; }

  // What to call the forces in notes to the user; in their order.
  void name_forces(std::vector<std::string> names) { names_ = std::move(names); }
  std::string name_of(const Force& force) const;

  std::size_t size() const noexcept override { return layout_.size(); }
  void eval(double t, const Stage& stage, double* y, double* dydt) override;
  void combine(const Stage& stage, double* out) override;
  std::unique_ptr<Stepper> explicit_stepper(const ExplicitPlan& plan) override;
  std::unique_ptr<EmbeddedStepper> embedded_stepper(const EmbeddedPlan& plan) override;
  std::unique_ptr<Stepper> split_stepper(const SplitPlan& plan) override;
  std::unique_ptr<StageSolver> stage_solver(const StageOptions& options) override;
  std::unique_ptr<Jacobian> jacobian() override;

  // Calls f(begin, end) for parts of the first `blocks` coordinates of a state, on all threads.
  template <class F>
  void for_ranges(int blocks, const F& f) const {
    team_->run_parts(layout_.n(), 8, [&](int begin, int end) {
      for (int block = 0; block < blocks; ++block) {
        const auto first = layout_.offset(block);
        f(first + static_cast<std::size_t>(begin), first + static_cast<std::size_t>(end));
      }
    });
  }

  // For steppers: what a sweep over the springs needs.
  Team& team() const noexcept { return *team_; }
  const Motion& motion() const noexcept { return motion_; }
  // How far below and above a block a sweep reads positions; a multiple of kGrain.
  int reach() const noexcept { return reach_; }

  std::span<const SpringRun* const> runs() const noexcept { return runs_; }
  std::span<const Net* const> nets() const noexcept { return net_forces_.nets(); }
  std::span<const double> masses() const noexcept { return mass_; }  // kg; infinity where pinned

  // a := the accelerations, in m/s^2; every array but the masses of the view padded as in a layout.
  void accelerate(const ParticleView& view, double* const a[3]);

  // Forces that are neither affine nor in runs may read any position and velocity of the stage, and
  // must be gathered before the sweep of each block.
  bool has_other_forces() const noexcept { return !other_forces_.empty() || !nets().empty(); }
  bool needs_velocities() const noexcept { return needs_velocities_; }
  std::span<Force* const> other_forces() const noexcept { return other_forces_; }
  // Before gather(): once per evaluation, on the thread that calls.
  void prepare_gather(const ParticleView& view);
  void gather(const ParticleView& view, Tile tile, ForceSink sink) const;  // sink := their sum

 private:
  Layout layout_;
  std::vector<double> mass_, inverse_mass_;
  std::vector<std::uint8_t> free_;
  int pinned_count_ = 0;
  std::vector<std::unique_ptr<Force>> forces_;
  std::vector<std::string> names_;
  Motion motion_;
  std::vector<const SpringRun*> runs_;
  NetForces net_forces_;
  std::vector<Force*> other_forces_;
  bool needs_velocities_ = false, has_dashpots_ = false;
  int reach_ = 0;
  SweepKernels<double> kernels_ = sweep_kernels<double>();
  CombineRange combine_range_ = combine_range();
  Team* team_;
  std::vector<Rings<double>> rings_;  // of eval(), one a rank
};

}  // namespace sim
