// Contact of surfaces as a correction of steps.
#pragma once

#include "core/particles/step_correction.h"
#include "core/particles/surface_contact/surface_contact.h"

namespace sim {

class SurfaceCorrection final : public StepCorrection {
 public:
  SurfaceCorrection(SurfaceContactSpec spec, Particles& particles, Holding* holding,
                    const ParticleView& initial)
      : contact_(std::move(spec), particles, holding, initial), particles_(&particles) {}

  // Particles of surfaces do not enter these bodies; surfaces: of each.
  void touch(const Solids& solids, std::span<const Surface> surfaces) {
    contact_.touch(solids, surfaces);
  }

  Outcome apply(const Step& step) override;
  std::string failure() const override { return contact_.refusal(); }
  std::string title() const override { return "sim.contact"; }
  double take_dissipation(double late) override { return contact_.take_work(late); }
  Account account() const override;
  void tear(std::span<const std::array<int, 2>> torn) override { contact_.tear(torn); }
  std::string objection(double t, const double* x) override {
    return contact_.objection(particles_->view(t, x));
  }

 private:
  SurfaceContact contact_;
  Particles* particles_;
};

}  // namespace sim
