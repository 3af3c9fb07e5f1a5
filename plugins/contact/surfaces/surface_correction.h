// Contact of surfaces as a correction of steps.
#pragma once

#include "core/particles/step_correction.h"
#include "surface_contact.h"

namespace sim {

class SurfaceCorrection final : public StepCorrection {
 public:
  SurfaceCorrection(SurfaceContactSpec spec, Particles& particles,
                    ConstraintSystem* constraint_system, const ParticleView& initial);

  Outcome apply(const Step& step) override;
  std::string failure() const override { return contact_.refusal(); }
  std::string title() const override { return "sim.contact"; }
  double take_dissipation(double late) override { return contact_.take_work(late); }
  Account account() const override;
  void tear(std::span<const std::array<int, 2>> torn) override { contact_.tear(torn); }
  std::string objection(double t, const double* x) override {
    return contact_.objection(particles_->view(t, x));
  }
  void keep_out_of(const BodyGeometry& bodies, const double* initial) override {
    contact_.keep_out_of(bodies, particles_->view(0, initial));
  }

 private:
  SurfaceContact contact_;
  Particles* particles_;
};

}  // namespace sim
