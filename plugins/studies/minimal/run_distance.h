// The visible results of a run at equal times, whatever its step, and their distance from those of
// another run.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/study/study.h"

namespace sim::study {

struct Look {
  // [k][3 i ..] = where particle i, or the numbers of a flat state, are at k time / intervals.
  std::vector<std::vector<double>> positions;
  std::vector<double> energies;               // J; empty in a first-order system
  std::vector<std::vector<double>> observed;  // [k][observer]
  std::vector<double> ranges;                 // of each observer
  double figure = std::nan("");               // if the problem asks for one, of all steps
  double size = 1, in_play = 0;               // m; J
  bool flat = false, finished = false;
  double seconds = 0;  // of stepping, the least of some runs
  std::int64_t evaluations = 0;
};

// Runs the problem as it is; looks between steps are at short ones, which are taken back. Nothing
// when told to end.
std::optional<Look> look_at(const Problem& problem, double time,
                            const std::function<bool()>& go_on);

// The largest differences on the way. Scenes of different numbers of particles are compared by how
// far those have come that were nearest at the start, both scenes as large as the first.
struct RunDistance {
  double positions = std::nan("");  // as a share of the size
  double energy = std::nan("");     // as a share of the energy in play
  std::vector<double> observed;     // of each
  double figure = std::nan("");     // of the whole run
};
RunDistance run_distance(const Look& whole, const Look& other);

}  // namespace sim::study
