// SIGINT and SIGTERM during a run: remembered, so that the run ends after its current step.
#pragma once

#include <csignal>
#include <exception>

namespace sim::cli {

// While one exists, the first of each signal is only remembered; a second one ends the program.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();  // the handlers from before are back
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  int caught() const;  // the signal, or 0

 private:
  struct sigaction before_int_, before_term_;
};

// Thrown by what stops because of a signal.
struct Interrupted : std::exception {};

// The same for a session: none restarts a system call, and none ends the program but the third
// since clear(), and SIGTERM when nothing has heard it for 2 s: a call into a library cannot be
// stopped.
class SessionSignals {
 public:
  SessionSignals();

  static int caught();  // the last one since clear(), or 0
  static bool any() { return caught() != 0; }
  static void clear();
  static void check();  // throws Interrupted
};

}  // namespace sim::cli
