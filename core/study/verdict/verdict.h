// The judgement at the end of a run: what was watched on the way, and what it says in numbers.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "core/study/energy_balance.h"
#include "core/study/problem.h"
#include "core/study/verdict/strain.h"

namespace sim::study {

enum class Trust { kTrusted, kSuspect, kDiverged };

const char* trust_name(Trust trust);  // "trusted", "suspect", "diverged"

// Not a number: not known.
struct Figures {
  double energy = std::nan("");      // largest |E + W - E(0)| and what is unknown of W, that drag
                                     // has taken, over the energy in play
  double dt_share = std::nan("");    // of the largest stable step; 0: any is, infinity: none is
  bool at_most = false;              // dt_share comes from the bound on omega
  double growth = std::nan("");      // of the fastest mode over the whole run, natural logarithm
  StrainedSpring strain;             // the worst seen
  double step_error = std::nan("");  // m, of one step, by doubling it
  double momentum = std::nan("");    // change over the momentum in play, where it must hold
};

struct Verdict {
  Trust trust = Trust::kTrusted;
  std::string reason;
  Figures figures{};
};

// Largest difference to the exact solution over the numbers of the present state, and its size; not
// a number when the solution has another length. The system has one.
struct Deviation {
  double error = 0, size = 0;  // in the units of the state
};
Deviation deviation(const SystemSpec& spec, const Simulation& system);

// Watches one system. What makes a run suspect:
// - energy: E + W off by more than 1 % of the energy in play. Where the forces are not all gravity,
//   springs and drag it is not checked; where drag is too quick for the looks, only a rise of E;
// - the step: beyond the largest stable one, so that the fastest mode grows; without drag already
//   beyond 80 % of it;
// - a step that doubling shows to be off by more than 1 % of the scene's size;
// - momentum that changes where no pin and no drag is;
// - an exact solution that is missed by more than 1 % of its size.
// It has diverged, although its numbers are finite, when the energy rose a million times above all
// that there was at the start.
class Monitor {
 public:
  // Spec and system outlive it. `steps` the run is to take; the registry, if given, is asked for
  // another integrator of the same kind, for the doubled steps.
  Monitor(const SystemSpec& spec, Simulation& system, std::int64_t steps, Registry* registry);

  // After steps, at most due() of them.
  void advance(std::int64_t steps = 1) {
    if (balance_) balance_->advance(steps);
  }
  std::int64_t due() const {
    return balance_ ? balance_->due() : std::numeric_limits<std::int64_t>::max();
  }
  // At the present state, at equal intervals of time; `energy` in a second-order system only.
  void look(const Energy* energy);

  // Of the run up to the present state.
  Verdict verdict();

 private:
  void look_at_exact();
  void look_at_limit();
  void look_at_strain();
  void double_a_step();
  double momentum_change() const;
  std::string energy_words(bool& suspect) const;

  const SystemSpec* spec_;
  Simulation* system_;
  std::int64_t steps_;
  std::optional<EnergyBalance> balance_;
  double start_scale_ = 0;  // J, at the start and the first time that anything moves
  double highest_ = 0;      // J, rise of E above the start
  double largest_ = 0;      // J, |E| as the sum of its parts
  Energy start_;
  Vec3 start_momentum_ = Vec3::Zero();
  double mass_ = 0;     // kg, of free particles
  double start_t_ = 0;  // s
  std::unique_ptr<StepMap> doubled_;
  double size_ = 1;                           // m
  int looks_ = 0, probes_ = 0, strains_ = 0;  // taken; to be taken in the run
  std::int64_t last_limit_ = -1, last_strain_ = -1, last_probe_ = -1;  // steps
  double error_ = 0, exact_size_ = 0;                                  // largest seen
  Figures figures_;
};

}  // namespace sim::study
