// The deviation of a run from its refined run, and the verdict on it.
#pragma once

#include <cmath>
#include <vector>

#include "core/study/problem.h"
#include "core/study/verdict/strain.h"

namespace sim::study {

struct Finding;

// The deviation of a quantity that the scene observes, in the refined run and in neighbours.
struct ObservedDeviation {
  double at_end = 0, most = 0;       // at the last state; largest of the run
  double neighbours = std::nan("");  // at the last state, the largest; where they were asked
};

// A figure of the whole run, in the refined run and in neighbours.
struct OtherFigures {
  double shadow = 0;
  std::vector<double> neighbours{};
};

// The deviation of a run from its refined run, and from its neighbours if that is large.
struct RunDeviation {
  enum class Outcome { kNone, kStopped, kShadowFailed, kCompared };
  static constexpr double kWrong = 0.02;  // error that is one, of the size

  Outcome outcome = Outcome::kNone;
  double until = HUGE_VAL;       // s; where the two were compared up to that time only
  double error = std::nan("");   // largest of the run, of a particle, in m, or of a number
  double rms = std::nan("");     // of all, the largest of the run, if asked for
  double at_end = std::nan("");  // the largest of one at the last state
  double share = std::nan("");   // largest error over the scene's size at that time
  double allowed = kWrong;       // ... from which on the run is wrong
  double energy = std::nan("");  // largest |E - E of the shadow| over the energy in play
  double horizon = HUGE_VAL;     // s; until then the error is below 2 % of the size
  double growth = std::nan("");  // factor by which neighbouring states part in the whole run
  double rate = std::nan("");    // ... in one second
  StrainedSpring strain{};       // worst of the shadow, which may show states in between
  std::vector<ObservedDeviation> observed{};  // of each observer of the scene
  std::vector<OtherFigures> figures{};        // as StepDoubling::judge() asked
  double missed_at = std::nan("");  // s, of a value of the right-hand side that no step has seen
  bool missed_motion = false;       // ... or of the motion of a prescribed particle or collider

  double others_broke_at = std::nan("");  // s, from when on the shadow has other broken ties

  Pinch pinch{};                     // the narrowest of the shadow
  double pinched_at = std::nan("");  // s, when that was too narrow to know how it came out

  bool verified() const { return outcome == Outcome::kCompared; }

  static constexpr double kNeighbour = 1e-7;  // how far away neighbours begin, of the size
  static constexpr double kChaos = 1e5;       // growth: neighbours part that far, and stay apart
  bool chaotic() const { return growth > kChaos; }
};

// The finding on a deviation; empty words if there was no refined run.
Finding finding_of(const RunDeviation& deviation, const Simulation& run);

}  // namespace sim::study
