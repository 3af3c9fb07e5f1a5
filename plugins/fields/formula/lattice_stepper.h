// Explicit Runge-Kutta steps of formulas on a lattice.
#pragma once

#include <memory>
#include <vector>

#include "core/ode/ode_system.h"
#include "lattice.h"
#include "lattice_program.h"

namespace sim {

// Steps of equal size, row by row: a stage computes slopes of a row, adds them to the next state
// and writes the point of the next stage. Slab i of a stage comes as soon as the slabs around it
// are there of the stage before, while those are still in the cache (a skewed loop, Wolfe 1986);
// the slabs of points that no stage will read again are overwritten. A small lattice is kept whole,
// and stages follow each other.
class LatticeStepper final : public Stepper {
 public:
  // `lattice` must live longer. The code is that of the slopes.
  LatticeStepper(const Lattice& lattice, const LatticeNeighbours& neighbours, const Code& code,
                 const ExplicitPlan& plan);

  // True if instructions can name all slots.
  static bool fits(const Code& code, const ExplicitPlan& plan);

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  int at_once() const override { return at_once_; }

 private:
  struct Weight {
    int slot;
    double weight;  // its number is h times that
  };
  struct Stage {
    VectorCode code;
    int time;  // slot
    std::vector<Weight> weights;
  };

  Stage stage(const Code& code, int number);
  void set_step(double h);
  void sweep();
  void run_slab(int stage, int slab);
  bool is_kept(int stage) const;  // its slopes, for stages behind the next one

  const Lattice& lattice_;
  const LatticeNeighbours& neighbours_;
  ExplicitPlan plan_;
  int lag_ = 0;    // slabs from a stage to the next
  int extra_ = 0;  // slabs beyond each end, for each stage that follows
  int at_once_;
  double h_ = 0;
  std::vector<std::pair<int, int>> rows_;
  std::vector<Stage> stages_;
  std::vector<double*> arrays_;
  LatticeRows x_, next_, slopes_;
  LatticeRows beyond_;               // where the next state goes that is computed beyond the ends
  std::vector<LatticeRows> points_;  // of the stages but the first
};

}  // namespace sim
