// Reordering of particles: explicit steps of nets whose springs join distant ids are made in
// another order, in which the springs form runs, or at least join near ids.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/particles.h"
#include "core/particles/springs/springs.h"

namespace sim {

// An order of all particles, and the springs in it.
class Reordering {
 public:
  // An order for the active springs, some of them in a reordered net: by rows if these form runs,
  // otherwise as the net orders them.
  Reordering(const Particles& particles, const std::vector<int>& rows);

  // Row by row of the grid that the positions form, if any: the direction with the fewest planes
  // runs fastest.
  static std::vector<int> rows_of(const ParticleView& view);

  bool fits(const Particles& particles) const;           // it has the springs that are on
  std::span<const int> order() const { return order_; }  // the particle at each place
  std::span<const int> place() const { return place_; }  // of each particle
  std::span<const Springs> springs() const { return springs_; }

 private:
  void number_springs(const Particles& particles);

  std::vector<const Springs*> given_;
  std::vector<int> order_, place_;
  std::vector<Springs> springs_;  // of each force that has some
};

// Steps the particles in the order of a numbering, under springs and affine forces alone, by the
// stepper that a method has for these.
class ReorderedStepper final : public Stepper {
 public:
  using Make = std::function<std::unique_ptr<Stepper>(Particles&)>;

  ReorderedStepper(const Particles& particles, std::shared_ptr<const Reordering> numbering,
                   const Make& make);

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  int at_once() const override { return stepper_->at_once(); }
  void restart() override;

 private:
  std::shared_ptr<const Reordering> numbering_;
  Array states_[2];  // in the other order; the one made last is that at last_ of the system
  int now_ = 0;
  const double* last_ = nullptr;
  std::unique_ptr<Particles> particles_;
  std::unique_ptr<Stepper> stepper_;
};

}  // namespace sim
