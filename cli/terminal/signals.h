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

// The same for a session: no signal ends the program, and none restarts a system call.
class SessionSignals {
 public:
  SessionSignals();

  static int caught();  // the last one since clear(), or 0
  static bool any() { return caught() != 0; }
  static void clear();
  static void check();  // throws Interrupted
};

}  // namespace sim::cli
