// SIGINT, SIGTERM, SIGHUP and SIGXCPU during a run: remembered, so that the run ends after its
// current step.
#pragma once

#include <array>
#include <csignal>
#include <exception>

namespace sim::cli {

// While one exists, signals are only remembered. Signals within a second count as one, for some
// programs send each twice; after that the third signal ends the program at once, but not before a
// pending checkpoint is written: then SIGQUIT and SIGUSR1, 2 are only remembered, too.
class Interrupts {
 public:
  explicit Interrupts(bool owes_checkpoint = false);
  ~Interrupts();  // the handlers from before are back
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  int caught() const;         // the first signal, or 0
  void checkpoint_is_safe();  // ends the program where a signal has asked for that meanwhile

 private:
  std::array<struct sigaction, 7> before_;
  std::size_t count_;  // of the signals that it hears
  bool owed_before_;
};

// Thrown by work that stops because of a signal.
struct Interrupted : std::exception {};

// The same for a session: none restarts a system call. Code that ignores the first signal (a plugin
// that loops) is ended by the second, some moments later, or by the third; and by SIGTERM and
// SIGHUP after 2 s.
class SessionSignals {
 public:
  SessionSignals();

  static int caught();  // the last one since clear(), or 0
  static bool any() { return caught() != 0; }
  static void clear();
  static void forget_interrupt();  // an old one; a signal to end stays
  static void check();             // throws Interrupted
};

}  // namespace sim::cli
