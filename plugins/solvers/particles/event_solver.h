// Implicit stages of methods that end their steps at impacts.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/ode/ode_system.h"
#include "core/particles/particle_impact_events.h"

namespace sim {

// Without resting contacts f is that of the particles alone, and solved as such.
class EventSolver final : public StageSolver {
 public:
  EventSolver(ParticleImpactEvents& events, bool rubs, std::unique_ptr<StageSolver> free,
              std::unique_ptr<StageSolver> lying)
      : events_(&events), rubs_(rubs), free_(std::move(free)), lying_(std::move(lying)) {}

  StepStatus solve(double t, double tau, const double* r, double* y) override {
    return (events_->holds_at(t) ? lying_ : free_)->solve(t, tau, r, y);
  }
  Effort effort() const override { return free_->effort() + lying_->effort(); }
  std::vector<std::string> notes() const override {
    std::vector<std::string> notes = free_->notes();
    for (const std::string& note : lying_->notes()) notes.push_back(note);
    if (rubs_)
      notes.push_back(
          "friction is part of the equations of a stage here: where many particles rub, steps get "
          "short or have no solution; trbdf2 does without");
    return notes;
  }

 private:
  ParticleImpactEvents* events_;
  bool rubs_;  // a collider has friction
  std::unique_ptr<StageSolver> free_, lying_;
};

}  // namespace sim
