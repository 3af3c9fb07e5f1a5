// An incompressible fluid as a correction of steps.
#pragma once

#include "core/particles/particles.h"
#include "core/particles/step_correction.h"
#include "fluid_projection.h"

namespace sim {

class FluidCorrection final : public StepCorrection {
 public:
  // All three outlive it; the projection is that of the fluid.
  FluidCorrection(FluidProjection& projection, const Force& fluid, Particles& particles)
      : projection_(&projection), fluid_(&fluid), particles_(&particles) {}

  Outcome apply(const Step& step) override;
  std::string title() const override { return "a fluid with solver = \"dfsph\""; }
  std::string remedy() const override { return "give the fluid solver = \"wcsph\""; }
  double take_dissipation(double late) override { return std::exchange(work_, 0.0) + late; }
  void reset() override { projection_->forget(); }
  Account account() const override { return projection_->account(); }
  bool breaks_constraints(int particle) const override { return projection_->leads(particle); }
  bool stands_for_forces() const override { return true; }

 private:
  std::span<double> pressures(double* state) const;

  FluidProjection* projection_;
  const Force* fluid_;
  Particles* particles_;
  double work_ = 0;  // J
};

}  // namespace sim
