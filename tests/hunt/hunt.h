// The hunt for false verdicts: scenes at random, each judged by the program and by a reference.
#pragma once

#include <array>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "core/study/verdict/verdict.h"

namespace sim_test {

// How far the run really was from the solution.
enum class Truth { kRight, kBetween, kWrong, kWrongAndChaotic, kUnknown };

struct Case {
  std::uint64_t seed = 0;
  std::string words;  // the scene, the method, the step
  sim::study::Trust verdict = sim::study::Trust::kTrusted;
  std::string reason;
  Truth truth = Truth::kUnknown;
  double off = 0, energy = 0, growth = 0;  // shares of the size and of the energy in play; a factor
};

// Makes the scene of this seed, runs it as `sim` does, and looks at the truth.
Case hunt_one(std::uint64_t seed, sim::Registry& registry);

struct Tally {
  std::array<std::array<int, 5>, 5> count{};  // [verdict][truth]

  void add(const Case& found);
  int judged() const;
  int trusted_but_wrong() const;
  int right() const;              // off by less than 0.01 %
  int right_but_doubted() const;  // suspect or diverged all the same
};

std::ostream& operator<<(std::ostream& out, const Tally& tally);
std::ostream& operator<<(std::ostream& out, const Case& found);

}  // namespace sim_test
