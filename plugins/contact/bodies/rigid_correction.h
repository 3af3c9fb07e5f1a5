// Contact of rigid bodies as a correction of steps.
#pragma once

#include "core/particles/step_correction.h"
#include "rigid_contact.h"

namespace sim {

class RigidCorrection final : public StepCorrection {
 public:
  RigidCorrection(BodyCollision body_collision, Particles& particles,
                  ConstraintSystem* constraint_system, double tolerance)
      : contact_(std::move(body_collision), particles, constraint_system, tolerance) {}

  Outcome apply(const Step& step) override { return contact_.resolve(step); }
  std::string failure() const override { return contact_.refusal(); }
  std::string title() const override { return "contact of rigid bodies"; }
  std::string remedy() const override { return "give the bodies touches = false"; }
  double take_dissipation(double late) override { return contact_.take_work() + late; }
  void reset() override { contact_.forget(); }
  Account account() const override;
  bool has_memory() const override { return true; }
  std::vector<double> memory() const override { return contact_.memory(); }
  void recall(std::span<const double> memory) override {
    contact_.forget();
    if (!memory.empty()) contact_.recall(memory);
  }
  const BodyGeometry* bodies() const override { return &contact_.body_collision(); }

 private:
  RigidContact contact_;
};

}  // namespace sim
