#include "cli/terminal/signals.h"

namespace sim::cli {
namespace {

// A handler can reach nothing but static storage.
volatile std::sig_atomic_t caught_signal = 0;

extern "C" void remember_signal(int signal) { caught_signal = signal; }

}  // namespace

Interrupts::Interrupts() {
  caught_signal = 0;
  struct sigaction action {};
  action.sa_handler = remember_signal;
  action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &before_int_);
  sigaction(SIGTERM, &action, &before_term_);
}

Interrupts::~Interrupts() {
  sigaction(SIGINT, &before_int_, nullptr);
  sigaction(SIGTERM, &before_term_, nullptr);
}

int Interrupts::caught() const { return caught_signal; }

SessionSignals::SessionSignals() {
  clear();
  struct sigaction action {};
  action.sa_handler = remember_signal;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int SessionSignals::caught() { return caught_signal; }
void SessionSignals::clear() { caught_signal = 0; }

void SessionSignals::check() {
  if (any()) throw Interrupted();
}

}  // namespace sim::cli
