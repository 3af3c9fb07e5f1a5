// The verdict at the end of a run: the observations during the run, and their figures.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/particles/constraints/constraint_force.h"
#include "core/particles/continuum_force.h"
#include "core/study/energy_balance.h"
#include "core/study/problem.h"
#include "core/study/verdict/step_doubling.h"
#include "core/study/verdict/strain.h"

namespace sim::study {

// kUnverified: all that was checked is right, but not everything was checked, for the given reason.
// kChaotic: neighbouring states diverge, so that positions are right up to some time only, with any
// method; all else that was checked is right.
enum class Trust { kTrusted, kUnverified, kChaotic, kSuspect, kDiverged };

const char* trust_name(Trust trust);  // "trusted", "unverified", "chaotic", ..

// Figures that are not a number are not known.
struct Figures {
  double energy = std::nan("");      // largest |E + W - E(0)| and the uncertainty of W, which drag
                                     // has taken, over the energy in play
  double dt_share = std::nan("");    // of the largest stable step; 0: any is, infinity: none is
  bool at_most = false;              // dt_share comes from the bound on omega
  double growth = std::nan("");      // of the fastest mode over the whole run, natural logarithm
  StrainedSpring strain;             // the worst seen
  CellQuality cells;                 // of bodies that forces fill with cells, likewise
  double step_error = std::nan("");  // m, of one step, by doubling it
  double momentum = std::nan("");    // change over the momentum in play, where it must hold
  ConstraintDrift constraints;       // the worst seen
  std::int64_t crossings = 0;        // of surfaces, the most seen
  RunDeviation shadow;               // from a run with half the step
};

struct Verdict {
  Trust trust = Trust::kTrusted;
  std::string reason;
  Figures figures{};
};

// Largest difference to the exact solution over the numbers of the present state, and its size; not
// a number if the solution has another length. The system has one.
struct Deviation {
  double error = 0, size = 0;  // in the units of the state
};
Deviation deviation(const SystemSpec& spec, const Simulation& system);

class Criterion;

// Watches one system. A run is suspect because of:
// - its refined run, with half the step: if the two differ by more than 2 % of the scene's size;
// - energy: E + W off by more than 1 % of the energy in play;
// - the step: beyond the largest stable one, so that the fastest mode grows; without drag already
//   beyond 80 % of it;
// - a step whose error by doubling is more than 1 % of the scene's size;
// - momentum that changes although nothing holds or drags; a conservative force that is not -dU/dx;
// - forces, energies or contact of a kernel that differ from those of scalar code;
// - an exact solution that is missed by more than 1 % of its size.
// It has diverged, although its numbers are finite, if the energy rose to a million times all that
// there was at the start.
class Monitor {
 public:
  // Spec and system outlive it. `steps`: of the run; the registry, if given, provides another
  // integrator of the same kind, for the doubled steps.
  Monitor(const SystemSpec& spec, Simulation& system, std::int64_t steps, Registry* registry);
  ~Monitor();
  Monitor(Monitor&&) noexcept;
  Monitor& operator=(Monitor&&) noexcept;

  // Called after steps, at most due() of them.
  void advance(std::int64_t steps = 1) {
    if (balance_) balance_->advance(steps);
  }
  std::int64_t due() const {
    return balance_ ? balance_->due() : std::numeric_limits<std::int64_t>::max();
  }
  std::vector<double> work_memory() const {
    return balance_ ? balance_->memory() : std::vector<double>();
  }
  bool recall_work(std::span<const double> memory) { return balance_ && balance_->recall(memory); }
  double work() const { return balance_ ? balance_->taken() : 0; }  // by drag so far, J
  // Called after a user changed the energy by so much, in J; see EnergyBalance.
  void touched(double energy);
  void end_anywhere() {  // at any step, see EnergyBalance
    if (balance_) balance_->end_anywhere();
  }
  // Samples the present state, at intervals; `energy` in a second-order system only.
  void look(const Energy* energy);

  bool exploded() const;                 // as far as the samples show: far above the start
  bool sound() const { return sound_; }  // not, and energy mostly kept, at the last look
  // The verdict on the run up to the present state, which is sampled if the last sample was
  // earlier; `deviation` from its refined run, if it had one.
  Verdict verdict(const RunDeviation& deviation = {});

 private:
  void look_at_present();

  Simulation* system_;
  std::int64_t looked_ = -1;                // the step of the last look
  std::unique_ptr<EnergyBalance> balance_;  // null in a first-order system
  double start_scale_ = 0;  // J, at the start and the first time that anything moves
  double highest_ = 0;      // J, rise of E above the start
  Energy start_;
  bool touched_ = false, sound_ = true;  // by the user; see sound()
  double start_size_ = 0;                // largest number of a first-order state at the start
  std::vector<std::unique_ptr<Criterion>> criteria_;
};

}  // namespace sim::study
