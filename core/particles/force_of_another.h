// A force that delegates to another one, for a part of it or of the particles.
#pragma once

#include <span>

#include "core/particles/force.h"

namespace sim {

// A view of a force that belongs elsewhere, outlives this one and owns the internal variables.
class ForceOfAnother : public Force {
 public:
  int internal_size() const override { return other_->internal_size(); }
  void start(std::span<double> memory) const override { other_->start(memory); }
  void derive(const ParticleView& view, std::span<double> rate) const override {
    other_->derive(view, rate);
  }
  bool internal_depends_on_particles() const override {
    return other_->internal_depends_on_particles();
  }
  bool conservative() const override { return other_->conservative(); }

 protected:
  explicit ForceOfAnother(Force& other) : other_(&other) {}
  Force& other() const { return *other_; }

 private:
  Force* other_;
};

}  // namespace sim
