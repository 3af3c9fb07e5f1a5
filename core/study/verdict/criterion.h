// The interface of the criteria of a verdict: the energy, the step, the momentum, ...
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/study/problem.h"
#include "core/study/verdict/verdict.h"

namespace sim::study {

// The finding of one criterion on a run.
struct Finding {
  Trust trust = Trust::kTrusted;
  std::string words;
  // Weaker than a verification of the run, which outweighs it.
  bool presumed = false;
};

class Criterion {
 public:
  virtual ~Criterion() = default;

  // Called at the start, at intervals, and at the end; the energy is that of the present state,
  // null in a first-order system.
  virtual void look(const Energy* energy) = 0;

  // Called after a user has dragged, pinned or switched something: data prepared for the system is
  // void.
  virtual void touched() {}

  // Called at the last state: its figures, and its findings in the order in which they are
  // reported.
  virtual void conclude(Figures& figures, std::vector<Finding>& findings) = 0;
};

// The common arguments of all criteria; spec, system and registry outlive them.
struct Watched {
  const SystemSpec& spec;
  Simulation& system;
  std::int64_t steps;      // the run is to take
  Registry* registry;      // null: no other integrators can be made
  EnergyBalance* balance;  // null in a first-order system
};

constexpr double kTolerance = 0.01;  // of the energy in play, of the exact solution, of the size
constexpr double kAtRest = 1e-12;    // of the size: the coordinates move by roundings only

// The threshold for a method: the effect of rounding on steps with a loose tolerance, or in single
// precision.
inline double at_rest(const IntegratorInfo& info) {
  return info.precision == Precision::kSingle ? 1e-6 : info.adaptive ? 1e-5 : kAtRest;
}

// Each is null if it does not apply.
std::unique_ptr<Criterion> watch_exact(const Watched& run);
std::unique_ptr<Criterion> watch_energy(const Watched& run);
std::unique_ptr<Criterion> watch_limit(const Watched& run);
std::unique_ptr<Criterion> watch_strain(const Watched& run);
std::unique_ptr<Criterion> watch_cells(const Watched& run);
std::unique_ptr<Criterion> watch_single_steps(const Watched& run);
std::unique_ptr<Criterion> watch_momentum(const Watched& run);
std::unique_ptr<Criterion> watch_contact(const Watched& run);
std::unique_ptr<Criterion> watch_breaking(const Watched& run);
std::unique_ptr<Criterion> watch_sleep(const Watched& run);
std::unique_ptr<Criterion> watch_crossings(const Watched& run);
std::unique_ptr<Criterion> watch_constraints(const Watched& run);
std::unique_ptr<Criterion> watch_forces(const Watched& run);
std::unique_ptr<Criterion> watch_kernels(const Watched& run);

// Spreads `times` samples over a run of so many steps.
class Spread {
 public:
  Spread(std::int64_t steps, int times) : steps_(steps), times_(times) {}
  // True if the next sample is due at `step`; it then counts as taken there.
  bool take(std::int64_t step) {
    if (times_ == 0 || step <= 0 || (last_ >= 0 && step - last_ < steps_ / times_)) return false;
    last_ = step;
    return true;
  }
  std::int64_t last() const { return last_; }

 private:
  std::int64_t steps_, last_ = -1;
  int times_;
};

}  // namespace sim::study
