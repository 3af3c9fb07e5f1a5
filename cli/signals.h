// SIGINT and SIGTERM during a run: remembered, so that the run ends after its current step.
#pragma once

#include <csignal>

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

}  // namespace sim::cli
