#include "cli/terminal/signals.h"

#include <unistd.h>

namespace sim::cli {
namespace {

constexpr int kPatience = 3;      // signals, and
constexpr unsigned kSeconds = 2;  // s after SIGTERM, until what cannot be stopped is ended

// A handler can reach nothing but static storage.
volatile std::sig_atomic_t caught_signal = 0;

volatile std::sig_atomic_t signals_since = 0;

extern "C" void remember_signal(int signal) { caught_signal = signal; }

extern "C" void remember_or_end(int signal) {
  signals_since = signals_since + 1;
  if (signals_since >= kPatience || signal == SIGALRM)
    ::_exit(128 + (signal == SIGALRM ? SIGTERM : signal));
  caught_signal = signal;
  if (signal == SIGTERM) ::alarm(kSeconds);
}

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
  action.sa_handler = remember_or_end;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGALRM, &action, nullptr);
}

int SessionSignals::caught() { return caught_signal; }
void SessionSignals::clear() {
  caught_signal = 0;
  signals_since = 0;
}

void SessionSignals::check() {
  if (any()) throw Interrupted();
}

}  // namespace sim::cli
