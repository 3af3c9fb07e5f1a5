#include "cli/terminal/signals.h"

#include <time.h>
#include <unistd.h>

#include <cerrno>

namespace sim::cli {
namespace {

constexpr int kPatience = 3;      // signals at once, and
constexpr double kMoment = 0.3;   // s, after which the second is enough
constexpr unsigned kSeconds = 2;  // s after SIGTERM, until a process that does not stop is ended
// The last three only while a checkpoint is owed.
constexpr std::array<int, 7> kSignals{SIGINT, SIGTERM, SIGHUP, SIGXCPU, SIGQUIT, SIGUSR1, SIGUSR2};
constexpr std::size_t kUsual = 4;
constexpr double kOneSignal = 1;  // s

// A handler can reach nothing but static storage.
volatile std::sig_atomic_t caught_signal = 0;

volatile std::sig_atomic_t signals_since = 0;
timespec first_since{};

// The signals of a run.
volatile std::sig_atomic_t run_signals = 0, checkpoint_owed = 0, end_owed = 0;
timespec run_first{};

double seconds_since(const timespec& then) {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec - then.tv_sec) +
         1e-9 * static_cast<double>(now.tv_nsec - then.tv_nsec);
}

// The limit of processor time is told each second, and says nothing new.
extern "C" void remember_signal(int signal) {
  const int kept_error = errno;
  if (run_signals == 0) ::clock_gettime(CLOCK_MONOTONIC, &run_first);
  const bool again = run_signals > 0 && seconds_since(run_first) <= kOneSignal;
  if (run_signals == 0 || signal != SIGXCPU) run_signals = run_signals + 1;
  if (!again && run_signals >= kPatience && signal != SIGXCPU) {
    if (!checkpoint_owed) ::_exit(128 + signal);
    end_owed = signal;
  }
  if (!again && caught_signal == 0) caught_signal = signal;
  errno = kept_error;
}

extern "C" void remember_or_end(int signal) {
  const int kept_error = errno;
  if (signals_since == 0) ::clock_gettime(CLOCK_MONOTONIC, &first_since);
  const double waited = seconds_since(first_since);
  signals_since = signals_since + 1;
  if (signal == SIGALRM) ::_exit(128 + caught_signal);
  if (signals_since >= kPatience || (signals_since == 2 && waited > kMoment)) ::_exit(128 + signal);
  caught_signal = signal;
  if (signal != SIGINT) ::alarm(kSeconds);
  errno = kept_error;
}

// A program started without a terminal to lose (nohup) ignores SIGHUP.
void listen_to(int signal, const struct sigaction& action, struct sigaction* before) {
  struct sigaction now {};
  sigaction(signal, nullptr, &now);
  if (before) *before = now;
  if (signal == SIGHUP && now.sa_handler == SIG_IGN) return;
  sigaction(signal, &action, nullptr);
}

}  // namespace

Interrupts::Interrupts(bool owes_checkpoint)
    : count_(owes_checkpoint ? kSignals.size() : kUsual), owed_before_(checkpoint_owed != 0) {
  caught_signal = 0;
  run_signals = 0;
  end_owed = 0;
  checkpoint_owed = owes_checkpoint || owed_before_;
  struct sigaction action {};
  action.sa_handler = remember_signal;
  action.sa_flags = static_cast<int>(SA_RESTART);
  sigfillset(&action.sa_mask);
  for (std::size_t i = 0; i < count_; ++i) listen_to(kSignals[i], action, &before_[i]);
}

Interrupts::~Interrupts() {
  for (std::size_t i = 0; i < count_; ++i) sigaction(kSignals[i], &before_[i], nullptr);
  checkpoint_owed = owed_before_;
}

void Interrupts::checkpoint_is_safe() {
  checkpoint_owed = 0;
  if (end_owed) ::_exit(128 + end_owed);
}

int Interrupts::caught() const { return caught_signal; }

SessionSignals::SessionSignals() {
  clear();
  struct sigaction action {};
  action.sa_handler = remember_or_end;
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kUsual; ++i) listen_to(kSignals[i], action, nullptr);
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
