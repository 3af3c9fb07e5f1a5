// The work of drag and similar forces up to each state of a session.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/scene/simulation.h"
#include "core/study/work_integral.h"

namespace sim::cli {

// The work of each system up to the last state of its runs. A state reached in another way, for
// example by an edit, has another hash: its work is unknown.
class WorkLedger {
 public:
  // WorkIntegral::memory() at the present state of a system; null if unknown.
  const std::vector<double>* find(std::size_t index, const Simulation& system) const {
    const bool known = index < entries_.size() && !entries_[index].integral.empty() &&
                       entries_[index].hash == system.hash();
    return known ? &entries_[index].integral : nullptr;
  }

  void keep(std::size_t index, const Simulation& system, std::vector<double> integral) {
    if (index >= entries_.size()) entries_.resize(index + 1);
    entries_[index] = {system.hash(), std::move(integral)};
  }

  // In J; not a number if unknown.
  double work(std::size_t index, const Simulation& system) const {
    if (system.step_count() == 0 || system.conserves_energy()) return 0;
    study::WorkIntegral integral;
    const std::vector<double>* const known = find(index, system);
    return known && integral.recall(*known) ? integral.value() : std::nan("");
  }

 private:
  struct Entry {
    std::uint64_t hash = 0;
    std::vector<double> integral;
  };
  std::vector<Entry> entries_;
};

}  // namespace sim::cli
