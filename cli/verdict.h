// The judgement at the end of a run: what was watched on the way, and what it says in numbers.
#pragma once

#include <optional>
#include <string>

#include "core/scene/simulation.h"

namespace sim::cli {

enum class Trust { kTrusted, kSuspect, kDiverged };

const char* trust_name(Trust trust);  // "trusted", "suspect", "diverged"

struct Verdict {
  Trust trust = Trust::kTrusted;
  std::string reason;
};

// Watches one system. Gravity, springs and drag conserve or lose total energy, so a run is suspect
// when its energy rises above the start, or without drag falls below it, by more than 1 % of the
// energy in play: the largest
// kinetic energy + change of potential energy seen. It has diverged, although its numbers are
// finite, when the energy rose a million times above all that there was at the start. With an exact
// solution it is suspect when the error passes 1 % of the solution's size. Nothing else is
// checked, and the reason says so.
class Monitor {
 public:
  // conserves: nothing in the scene takes energy, so that it may not fall either.
  explicit Monitor(bool conserves) : conserves_(conserves) {}

  void watch(const Energy& energy);
  void watch_error(double error, double size);  // both in the units of the state

  Verdict verdict() const;

 private:
  bool conserves_;
  std::optional<Energy> start_;
  double last_ = 0, highest_ = 0, lowest_ = 0;  // total energy relative to the start, J
  double scale_ = 0;                            // energy in play, J
  double first_scale_ = 0;  // ... at the start and the first time that anything moves
  bool exact_ = false;
  double error_ = 0, size_ = 0;  // largest seen
};

}  // namespace sim::cli
