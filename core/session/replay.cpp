#include "core/session/replay.h"

#include <algorithm>
#include <limits>

namespace sim {

std::int64_t Replay::due(const Simulation& simulation) const {
  const std::int64_t end = moves_.due();
  const std::int64_t next = next_ < actions_.size() ? std::min(end, actions_[next_].step) : end;
  if (next == std::numeric_limits<std::int64_t>::max()) return next;
  return std::max<std::int64_t>(1, next - simulation.step_count());
}

std::optional<double> Replay::perform(Simulation& simulation) {
  const std::int64_t now = simulation.step_count();
  if (std::min(moves_.due(), next_ < actions_.size() ? actions_[next_].step : moves_.due()) > now)
    return {};
  const double before = simulation.energy().total();
  moves_.end_due(simulation);
  for (; next_ < actions_.size() && actions_[next_].step <= now; ++next_) {
    apply(simulation, actions_[next_].action);
    moves_.note(actions_[next_].action, now);
  }
  return simulation.energy().total() - before;
}

}  // namespace sim
