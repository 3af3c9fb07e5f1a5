// The hunt for false verdicts: scenes at random, each judged by the program and by a reference.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "core/study/verdict/verdict.h"

namespace sim_test {

// The true distance of the run from the solution.
enum class Truth { kRight, kBetween, kWrong, kWrongAndChaotic, kUnknown };

struct Case {
  std::uint64_t seed = 0;
  std::string words;  // the scene, the method, the step
  sim::study::Trust verdict = sim::study::Trust::kTrusted;
  std::string reason;
  Truth truth = Truth::kUnknown;
  double off = 0, energy = 0, growth = 0;  // shares of the size and of the energy in play; a factor
  double told = std::nan("");              // error that the verdict tells over the true one
  std::string failed;                      // why there was no run
  bool late = false;                       // it is chaotic, and wrong before the time that is told
  bool set_aside = false;                  // it took too long
  bool mesh = false;  // doubted for its mesh, of which no reference on the same one knows
};

struct HuntKind;

// The shares that right runs of chains and fields, and those of kinds, are off by at most.
inline constexpr double kRight = 1e-4, kRightOfKinds = 1e-3;

// A scene of this kind, by a method and a step at random, against two methods of other families
// that agree. The motion is known as long as they do.
Case hunt_one(const HuntKind& kind, std::uint64_t seed, sim::Registry& registry);

// Makes the scene of this seed, runs it as `sim` does, and looks at the truth.
Case hunt_one(std::uint64_t seed, sim::Registry& registry);

struct Tally {
  double right_share;  // of the size, and of the energy in play: what a right run is off by
  std::array<std::array<int, 5>, 5> count{};  // [verdict][truth]
  int told = 0, told_short = 0;  // errors of trusted runs, those below 2/3 of the true one
  int chaotic = 0, late = 0;     // times until when positions are right, those that are too late
  int failed = 0, set_aside = 0, mesh = 0;

  void add(const Case& found);
  int judged() const;
  int trusted_but_wrong() const;
  // At most 3 of 1000 false trusts, at most 3 % of the right runs doubted.
  bool good() const;
  int right() const;
  int right_but_doubted() const;  // suspect or diverged all the same, but for the mesh
};

std::ostream& operator<<(std::ostream& out, const Tally& tally);
std::ostream& operator<<(std::ostream& out, const Case& found);

}  // namespace sim_test
