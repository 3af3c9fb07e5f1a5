// A correction of the end of a step, whichever method made the step.
#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace sim {

class BodyGeometry;

// The interface through which studies, verdicts and checkpoints see the corrections of a system.
class StepCorrection {
 public:
  virtual ~StepCorrection() = default;

  // A step of length h (s) from the state x at t (s) to x_next.
  struct Step {
    double t, h;
    const double* x;
    double* x_next;
    bool may_be_halved = false;  // the method can take it in two halves instead
  };
  // kTooLong, for a step that may be halved: its halves are shorter than what it cannot follow.
  enum class Outcome { kUnchanged, kChanged, kTooLong, kFailed };
  // Projects x_next onto the states that it allows; kUnchanged: x_next keeps its bits. A pure
  // function of the step and of memory(), bit for bit. A long one asks
  // ThreadPool::gives_up(), and then ends with its memory and its account as they were. One that is
  // too long leaves its memory, and of its account all but the number of these.
  virtual Outcome apply(const Step& step) = 0;
  virtual std::string failure() const { return {}; }  // after kFailed: why, in one sentence

  virtual std::string title() const = 0;             // "sim.contact", as errors name it
  virtual std::string remedy() const { return {}; }  // how a scene avoids it: "give ..."
  // The energy, J, taken since the last call. late: the part, J, that is due to velocities of a
  // method that belong to another moment than its positions, late_work().
  virtual double take_dissipation(double late) = 0;
  virtual void reset() {}  // another run begins

  // The account for the verdict of all steps since reset().
  struct Account {
    std::string words;
    bool kept = true;   // its promise holds
    bool acted = true;  // or nothing was to be done
    std::vector<std::pair<std::string, double>> figures = {};
  };
  virtual Account account() const = 0;
  // Notes for the user on the scene.
  virtual std::vector<std::string> notes() const { return {}; }

  // The history on which the next step depends besides the state: part of a snapshot, if there is
  // any.
  virtual bool has_memory() const { return false; }
  virtual std::vector<double> memory() const { return {}; }
  virtual void recall(std::span<const double> /*memory*/) {}  // empty: as after reset()

  // The reason why a state set by the user is not allowed; empty if it is.
  virtual std::string objection(double /*t*/, const double* /*x*/) { return {}; }
  // True if it moves this particle regardless of constraints.
  virtual bool breaks_constraints(int /*particle*/) const { return false; }
  // Removes the faces of surfaces between these pairs of particles, see Force::tear().
  virtual void tear(std::span<const std::array<int, 2>> /*torn*/) {}
  // The rigid bodies that it keeps apart; null: none. Particles that another correction moves keep
  // out of them.
  virtual const BodyGeometry* bodies() const { return nullptr; }
  // The bodies outlive it. Throws Error{kScene} if it cannot keep out of them from the start.
  virtual void keep_out_of(const BodyGeometry& /*bodies*/, const double* /*initial*/) {}
  // True if it stands for forces: the scene has no meaning without it.
  virtual bool stands_for_forces() const { return false; }
};

}  // namespace sim
