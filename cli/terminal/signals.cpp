#include "cli/terminal/signals.h"

#include <time.h>
#include <unistd.h>

#include <cerrno>

namespace sim::cli {
namespace {

constexpr int kPatience = 3;      // signals at once, and
constexpr double kMoment = 0.3;   // s, after which the second is enough
constexpr unsigned kSeconds = 2;  // s after SIGTERM, until what cannot be stopped is ended
constexpr int kSignals[3] = {SIGINT, SIGTERM, SIGHUP};

// A handler can reach nothing but static storage.
volatile std::sig_atomic_t caught_signal = 0;

volatile std::sig_atomic_t signals_since = 0;
timespec first_since{};

extern "C" void remember_signal(int signal) { caught_signal = signal; }

extern "C" void remember_or_end(int signal) {
  const int kept_error = errno;
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  if (signals_since == 0) first_since = now;
  const double waited = static_cast<double>(now.tv_sec - first_since.tv_sec) +
                        1e-9 * static_cast<double>(now.tv_nsec - first_since.tv_nsec);
  signals_since = signals_since + 1;
  if (signal == SIGALRM) ::_exit(128 + caught_signal);
  if (signals_since >= kPatience || (signals_since == 2 && waited > kMoment)) ::_exit(128 + signal);
  caught_signal = signal;
  if (signal != SIGINT) ::alarm(kSeconds);
  errno = kept_error;
}

// Who started us without a terminal to lose (nohup) does not want SIGHUP to be heard.
void listen_to(int signal, const struct sigaction& action, struct sigaction* before) {
  struct sigaction now {};
  sigaction(signal, nullptr, &now);
  if (before) *before = now;
  if (signal == SIGHUP && now.sa_handler == SIG_IGN) return;
  sigaction(signal, &action, nullptr);
}

}  // namespace

Interrupts::Interrupts() {
  caught_signal = 0;
  struct sigaction action {};
  action.sa_handler = remember_signal;
  action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  for (int i = 0; i < 3; ++i) listen_to(kSignals[i], action, &before_[i]);
}

Interrupts::~Interrupts() {
  for (int i = 0; i < 3; ++i) sigaction(kSignals[i], &before_[i], nullptr);
}

int Interrupts::caught() const { return caught_signal; }

SessionSignals::SessionSignals() {
  clear();
  struct sigaction action {};
  action.sa_handler = remember_or_end;
  sigemptyset(&action.sa_mask);
  for (const int signal : kSignals) listen_to(signal, action, nullptr);
  sigaction(SIGALRM, &action, nullptr);
}

int SessionSignals::caught() { return caught_signal; }
void SessionSignals::clear() {
  caught_signal = 0;
  signals_since = 0;
  ::alarm(0);
}

void SessionSignals::forget_interrupt() {
  sigset_t ours, before;
  sigemptyset(&ours);
  for (const int signal : kSignals) sigaddset(&ours, signal);
  sigprocmask(SIG_BLOCK, &ours, &before);
  if (caught_signal == SIGINT) clear();
  sigprocmask(SIG_SETMASK, &before, nullptr);
}

void SessionSignals::check() {
  if (any()) throw Interrupted();
}

}  // namespace sim::cli
