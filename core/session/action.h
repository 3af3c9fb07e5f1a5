// An action of a user on a system between two steps, as a value: it can be stored, written down and
// repeated. The prompt, the page and the terminal change a running scene through these alone.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/plugin/method.h"
#include "core/scene/simulation.h"

namespace sim {

struct Action {
  enum class What {
    kGrab,        // the user holds the particle, with infinite mass
    kMove,        // held, it goes to x in so many steps along a line, and rests there
    kRelease,     // it flies on with the velocity it has; rests if it is pinned
    kPin,         // as Simulation::set_pinned
    kUnpin,       //
    kCut,         // as Simulation::cut(particle, other)
    kSwitch,      // `name` on or off
    kDt,          // value, s
    kIntegrator,  // `name`, and the method that it stands for
    kPosition,    // to x, m: a jump
    kVelocity,    // x, m/s
    kComponent,   // number `particle` of a flat state := value
    kReset        // as Simulation::reset
  };

  What what = What::kReset;
  int particle = -1, other = -1;
  Vec3 x{0, 0, 0};
  double value = 0;
  std::int64_t steps = 0;
  bool on = true;
  std::string name = {};
  std::optional<Method> method = {};  // of kIntegrator, found by whoever knows the plugins

  bool changes_settings() const;  // settings that a reset keeps
};

// "grab 3", "move 3 0.1 0 -2 over 16", "release 3", "pin 3", "unpin 3", "cut 3 4",
// "switch motor off", "dt 0.001", "integrator verlet", "position 3 0 1 0", "velocity 3 0 1 0",
// "component 0 1.5", "reset". Numbers come back to the last bit.
std::string to_text(const Action& action);

// Parses an action. Throws Error{kUsage}, with the expected syntax.
Action parse_action(std::string_view text);

// Applies an action between two steps. Throws Error{kUsage} for an unknown particle or switch, a
// number that is not finite, and a move of a particle that is not held; then nothing has changed. A
// move sets the velocity only: its end is in Moves.
void apply(Simulation& simulation, const Action& action);

// The moves in progress.
class Moves {
 public:
  void note(const Action& action, std::int64_t step);  // it was done at that step
  std::int64_t due()
      const;  // the step at which the next one ends; the largest number: there is none
  // Ends the actions that are due at the present step. True if there are any.
  bool end_due(Simulation& simulation);
  void forget_ended(std::int64_t step);  // those that ended before it, or at it
  void clear() { moves_.clear(); }

 private:
  struct Move {
    int particle;
    std::int64_t end;
  };
  std::vector<Move> moves_;
};

}  // namespace sim
