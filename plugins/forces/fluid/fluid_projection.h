// An incompressible fluid: corrections of density and velocity after each step.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/base/thread_pool.h"
#include "core/particles/collider.h"
#include "core/particles/step_correction.h"
#include "density_constraints.h"
#include "pressure_solve.h"

namespace sim {

// Two complementarity problems, after Bender & Koschier (2015), Divergence-free smoothed particle
// hydrodynamics, Proc. SCA 147-155, with the densities and walls of FluidLaw:
//   positions   n(x - M^-1 J' p) <= 1        in positions alone, repeated until it holds
//   viscosity   M (v' - v) = -h K v', with the pairs of FluidLaw: stable for any step
//   velocities  h J(v - M^-1 J' p) <= max(0, 1 - n)      in velocities alone
// with p >= 0 that is 0 wherever a row is not at its limit, for a fluid can be torn. All of it is
// of first order, conserves momentum, and takes energy, which the caller has to book. In contrast
// to the paper, velocities are not changed by the position error: that would add energy.
class FluidProjection {
 public:
  // error: of the density, the mean of max(n - 1, 0); ten times that of a single particle.
  FluidProjection(double error, std::vector<int> ids) : error_(error), ids_(std::move(ids)) {}

  void add_wall(std::unique_ptr<Collider> collider) { rows_.add_wall(std::move(collider)); }
  void bind(const FluidLaw& law, const ParticleView& initial);
  int count() const { return static_cast<int>(mass_.size()); }  // particles

  // The end of a step of length h (s): q and v are the positions and velocities of the view, memory
  // the pressures, Pa, which warm-start the next step.
  struct End {
    const ParticleView& view;
    double h;
    double* const* q;
    double* const* v;
    std::span<double> memory;
  };
  // Changes these numbers. False: no position and no velocity had to be changed. A pure function of
  // them, bit for bit.
  bool project(const End& end, ThreadPool& pool);
  bool leads(int particle) const {  // it may change this one
    return ids_.empty() || std::ranges::binary_search(ids_, particle);
  }
  StepCorrection::Account account() const;
  void forget();

 private:
  struct Counts {
    long steps = 0, missed = 0, products = 0;
    double mean = 0, worst = 0;  // of n - 1, the largest
  };
  ParticleView own(const ParticleView& view);
  bool is_free(int k) const { return mass_[static_cast<std::size_t>(k)] < HUGE_VAL; }
  int id_at(int place) const;
  bool meets_error();
  void load(const double* const* v);  // ways_ := v of each place
  void add(const double* changes, double* const* to) const;
  bool correct_places(const End& end, ThreadPool& pool);
  bool apply_viscosity(const End& end, ThreadPool& pool);
  bool correct_velocities(const End& end, ThreadPool& pool);

  FluidLaw law_;
  double error_;
  std::vector<int> ids_;
  DensityConstraints rows_;
  PressureSolve solve_;
  OrderedSums sum_;
  Array own_, mass_;                                // of each particle
  Array wanted_, rates_, displacements_;            // of each place
  Array changes_, residual_, direction_, product_;  // of viscosity
  double mean_ = 0, worst_ = 0;
  bool met_ = true;  // all of the last step
  Counts counts_;
};

}  // namespace sim
