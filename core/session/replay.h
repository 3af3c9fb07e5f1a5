// Replays the actions of a recording as their steps come.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/session/recording.h"

namespace sim {

class Replay {
 public:
  // Actions by step, all with resolved methods.
  explicit Replay(std::vector<RecordedAction> actions) : actions_(std::move(actions)) {}

  // The number of steps until the next action, at least 1; the largest number: none left.
  std::int64_t due(const Simulation& simulation) const;

  // Performs the actions that are due at the present state, once. Returns the energy that they
  // added, in J; empty if there were none. Throws as apply(); then line() is that of the action.
  std::optional<double> perform(Simulation& simulation);

  int line() const { return next_ < actions_.size() ? actions_[next_].line : 0; }

 private:
  std::vector<RecordedAction> actions_;
  std::size_t next_ = 0;
  Moves moves_;
};

}  // namespace sim
