// The history of a system, any state of which is restored bit for bit: snapshots within a budget of
// memory, and runs repeated from the nearest one.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/scene/simulation.h"
#include "core/session/action.h"

namespace sim {

// Going back before a change by hand restores the settings of then; going on from there makes it
// again when its step comes. A change in the past discards what came after. Changes between two
// calls of part() count as one. A copy is a branch: it shares the snapshots. Every call gets the
// simulation, standing where this timeline left it.
class Timeline {
 public:
  static constexpr std::size_t kDefaultBudget = std::size_t{64} << 20;  // bytes

  // Starts with the present state.
  explicit Timeline(const Simulation& simulation, std::size_t budget = kDefaultBudget);
  void begin_anew(const Simulation& simulation);  // at its present state, with nothing before

  // See Simulation::steps() and step().
  int steps(Simulation& simulation, std::int64_t most);
  bool step(Simulation& simulation) { return steps(simulation, 1) > 0; }
  bool step_to(Simulation& simulation, double end);  // a shorter one; discards the later history
  // A change by hand, kept by its step; a move that ends later is stopped by the steps. When it
  // throws, the timeline is as it was; and for edit(): a change that is no Action, with a snapshot.
  void act(Simulation& simulation, const Action& action);
  void edit(Simulation& simulation, const std::function<void(Simulation&)>& change);
  // Asked to look before anything is done or ends at a step that was just taken.
  void before_touch(std::function<void()> look) { look_ = std::move(look); }
  void part(const Simulation& simulation);  // the next change counts by itself
  // Takes back the last change up to the present step, and what came after; false: there is none.
  bool undo(Simulation& simulation);
  // Goes to the state after `step` steps, at least first(). False, at the last completed step,
  // where `go_on`, asked between steps, says so or a step fails.
  bool go_to(Simulation& simulation, std::int64_t step, const std::function<bool()>& go_on);

  void keep(const Simulation& simulation);  // takes a snapshot, so that a copy can start from here
  // Puts any simulation of the same scene where this timeline was at that step.
  bool enter(Simulation& simulation, std::int64_t step, const std::function<bool()>& go_on);

  std::int64_t first() const { return marks_.front().state->step; }  // older ones did not fit
  std::int64_t last() const { return last_; }                        // the last known step
  double first_t() const { return marks_.front().state->t(); }
  std::int64_t step_at(const Simulation& simulation, double t);  // the step nearest to t s
  std::int64_t touches() const { return touches_; }  // actions done or ended, repetitions too
  int edits() const;                                 // the changes that were not discarded
  int part_of_last() const { return done_ > 0 ? acts_[done_ - 1].part : -1; }  // of those actions
  std::size_t actions() const { return forgotten_.acts + done_; }              // up to the present

  // J, at the start, and what changes by hand have put in since: drift counts from there.
  double start_energy(const Simulation& simulation) const;
  void set_start(double energy);                     // of a timeline that has only begun
  std::int64_t common(const Timeline& other) const;  // the same up to there at least; or -1
  std::size_t bytes() const { return bytes_; }
  void set_budget(std::size_t bytes);

 private:
  struct Mark {
    std::shared_ptr<const Snapshot> state;
    bool edited, stays;  // a change that is no action was made here; it is never thinned out
    double start;        // J, from where the drift counts
    std::size_t acts;    // of the actions, so many came before
    bool cut = false;    // the step that ends here was a shorter one
  };
  struct Act {
    std::int64_t step;
    int part;
    Action action;
  };
  struct Forgotten {  // actions that are no longer kept
    std::size_t acts = 0;
    int parts = 0, part = -1;  // how many, and the last one
    Moves moves;               // going on at the first mark
  };
  void note(const Simulation& simulation, bool edited, bool stays = false);
  void discard_after(const Simulation& simulation);
  void perform(Simulation& simulation, const Action& action, std::int64_t step);
  void perform_due(Simulation& simulation);
  std::int64_t next_due() const;
  void count_bytes();
  void close_edit(const Simulation& simulation);
  void restore(Simulation& simulation, std::size_t mark);
  std::size_t mark_at_or_before(std::int64_t step) const;
  void thin();
  bool thin_marks();
  void forget_oldest();

  std::size_t budget_, bytes_ = 0;
  std::vector<Mark> marks_;  // by step; of several at one step the last one holds
  std::vector<Act> acts_;    // in order, after the discarded ones
  Forgotten forgotten_;
  std::size_t done_ = 0;  // of them, up to the present
  Moves moves_;
  std::int64_t last_ = 0;
  int part_ = 0;
  std::int64_t touches_ = 0;
  std::function<void()> look_;
  bool edit_open_ = false;  // the changes at the present step have no mark yet
  double before_edit_ = 0;  // J, total energy
  double start_ = 0;        // J
};

}  // namespace sim
