// SIGINT, SIGTERM and SIGHUP during a run: remembered, so that the run ends after its current step.
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
  struct sigaction before_[3];
};

// Thrown by what stops because of a signal.
struct Interrupted : std::exception {};

// The same for a session: none restarts a system call. What does not hear the first one (a plugin
// that loops) is ended by the second, some moments later, or the third; and by SIGTERM and SIGHUP
// after 2 s.
class SessionSignals {
 public:
  SessionSignals();

  static int caught();  // the last one since clear(), or 0
  static bool any() { return caught() != 0; }
  static void clear();
  static void forget_interrupt();  // of what is over; a signal to end stays
  static void check();             // throws Interrupted
};

}  // namespace sim::cli
