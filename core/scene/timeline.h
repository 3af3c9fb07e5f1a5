// Where a system has been, so that it can be there again bit for bit: snapshots within a budget of
// memory, and running again from the nearest one.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/scene/simulation.h"

namespace sim {

// A change by hand starts a new part of the timeline. Going back before it restores the settings of
// then; going on from there makes the change again when its step comes. A change in the past
// discards what came after. Changes between two calls of part() count as one. A copy is a branch:
// it shares the snapshots. Every call gets the simulation, standing where this timeline left it.
class Timeline {
 public:
  static constexpr std::size_t kDefaultBudget = std::size_t{64} << 20;  // bytes

  // Starts with the present state.
  explicit Timeline(const Simulation& simulation, std::size_t budget = kDefaultBudget);

  // As Simulation::steps() and step().
  int steps(Simulation& simulation, std::int64_t most);
  bool step(Simulation& simulation) { return steps(simulation, 1) > 0; }

  // A change by hand. When it throws, the timeline is as it was before.
  void edit(Simulation& simulation, const std::function<void(Simulation&)>& change);

  // The next change counts by itself, also at the same step.
  void part(const Simulation& simulation) { close_edit(simulation); }

  // Takes back the last change at or before the present step, and what came after it. False when
  // there is none.
  bool undo(Simulation& simulation);

  // To the state after `step` steps, at least first(). Asks `go_on` time and again; a no or a step
  // that fails leaves it at a whole step on the way, and gives false.
  bool go_to(Simulation& simulation, std::int64_t step, const std::function<bool()>& go_on);

  // Takes a snapshot of the present, so that a copy of this timeline can start from here.
  void keep(const Simulation& simulation);

  // Puts any simulation of the same scene where this timeline was at that step.
  bool enter(Simulation& simulation, std::int64_t step, const std::function<bool()>& go_on);

  std::int64_t first() const { return marks_.front().state->step; }  // older ones did not fit
  std::int64_t last() const { return last_; }                        // as far as it has been
  double first_t() const { return marks_.front().state->t(); }       // s
  std::int64_t step_at(const Simulation& simulation, double t);      // the step nearest to t s
  int edits() const;  // the changes that were not discarded

  // The total energy at the start, in J, and what changes by hand have put in since: drift counts
  // from there.
  double start_energy(const Simulation& simulation) const;
  void set_start(double energy);  // of a timeline that has only begun

  // Up to this step, at least, both are the same; -1 when they share nothing.
  std::int64_t common(const Timeline& other) const;

  std::size_t bytes() const { return bytes_; }
  void set_budget(std::size_t bytes);

 private:
  struct Mark {
    std::shared_ptr<const Snapshot> state;
    bool edited;   // a change was made here
    double start;  // J, from where the drift counts
  };

  void note(const Simulation& simulation, bool edited);
  void close_edit(const Simulation& simulation);
  void restore(Simulation& simulation, std::size_t mark);
  std::size_t mark_at_or_before(std::int64_t step) const;
  void thin();

  std::size_t budget_, bytes_ = 0;
  std::vector<Mark> marks_;  // by step; of several at one step the last one holds
  std::int64_t last_ = 0;
  bool edit_open_ = false;  // the changes at the present step have no mark yet
  double before_edit_ = 0;  // J, total energy
  double start_ = 0;        // J
};

}  // namespace sim
