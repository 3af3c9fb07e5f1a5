// The terminal itself: its modes, and what it sends.
#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <csignal>
#include <map>

#include "cli/view/terminal.h"
#include "core/base/error.h"

namespace sim::cli {
namespace {

// Another screen, no cursor, mouse with motion while a button is down, positions as numbers.
constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l\x1b[?1002h\x1b[?1006h\x1b[2J";
constexpr std::string_view kLeave = "\x1b[?1006l\x1b[?1002l\x1b[?25h\x1b[0m\x1b[?1049l";
constexpr int kDeadly[] = {SIGHUP, SIGQUIT, SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL};

termios modes_before;  // for the handler, which can be given nothing
struct sigaction actions_before[std::size(kDeadly)];

void write_all(std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(1, text.data(), text.size());
    if (count <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
}

// Only what a handler may call.
void restore_terminal() {
  write_all(kLeave);
  ::tcsetattr(0, TCSANOW, &modes_before);
}

void restore_and_die(int signal) {
  restore_terminal();
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

// "<0;12;7M", behind ESC [, from `at` on; 0: it may go on, -1: it is none.
int mouse_report(const std::string& text, std::size_t at, TerminalEvent& event) {
  int numbers[3];
  const char *from = text.data() + at + 1, *const end = text.data() + text.size();
  for (int i = 0; i < 3; ++i) {
    const auto [next, failed] = std::from_chars(from, end, numbers[i]);
    if (next == end) return text.size() - at > 24 ? -1 : 0;
    if (failed != std::errc() || (i < 2 && *next != ';') || numbers[i] < 0 || numbers[i] > 9999)
      return -1;
    from = next + (i < 2 ? 1 : 0);
  }
  if (*from != 'M' && *from != 'm') return -1;
  const int code = numbers[0];
  event.x = std::max(0, numbers[1] - 1);
  event.y = std::max(0, numbers[2] - 1);
  event.shift = (code & 4) != 0;
  event.control = (code & 16) != 0;
  event.button = code & 3;
  using What = TerminalEvent::What;
  if ((code & 64) != 0)
    event.what = What::kWheel;
  else
    event.what = *from == 'm' ? What::kRelease : (code & 32) != 0 ? What::kMove : What::kPress;
  return static_cast<int>(from + 1 - (text.data() + at));
}

}  // namespace

Takeover::Takeover() {
  if (::isatty(0) == 0 || ::tcgetattr(0, &modes_before) != 0)
    throw Error(ErrorKind::kIo, {"no terminal", "sim view --terminal",
                                 "standard input is no terminal", "leave out --terminal"});
  termios raw = modes_before;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  struct sigaction deadly {};
  deadly.sa_handler = restore_and_die;
  for (std::size_t i = 0; i < std::size(kDeadly); ++i)
    ::sigaction(kDeadly[i], &deadly, &actions_before[i]);
  ::tcsetattr(0, TCSANOW, &raw);
  write_all(kEnter);
}

Takeover::~Takeover() {
  restore_terminal();
  for (std::size_t i = 0; i < std::size(kDeadly); ++i)
    ::sigaction(kDeadly[i], &actions_before[i], nullptr);
}

std::vector<TerminalEvent> take_events(std::string& text) {
  static const std::map<char, const char*> kArrows{
      {'A', "Up"}, {'B', "Down"}, {'C', "Right"}, {'D', "Left"}, {'H', "Home"}};
  std::vector<TerminalEvent> events;
  std::size_t at = 0;
  while (at < text.size()) {
    TerminalEvent event;
    const char c = text[at];
    if (c != '\x1b') {
      event.key = c == ' ' ? "Space" : std::string(1, c);
      if (static_cast<unsigned char>(c) >= 32) events.push_back(event);
      ++at;
      continue;
    }
    if (at + 1 == text.size()) {  // alone: the key, unless more follows
      event.key = "Esc";
      events.push_back(event);
      ++at;
      continue;
    }
    if (text[at + 1] != '[' && text[at + 1] != 'O') {
      ++at;
      continue;
    }
    if (at + 2 == text.size()) break;
    if (text[at + 2] == '<') {
      const int used = mouse_report(text, at + 2, event);
      if (used == 0) break;
      if (used > 0) events.push_back(event);
      at += 2 + static_cast<std::size_t>(std::max(1, used));
      continue;
    }
    // Anything else ends with a letter.
    std::size_t end = at + 2;
    while (end < text.size() && (text[end] < '@' || text[end] > '~')) ++end;
    if (end == text.size() && end - at < 16) break;
    if (end < text.size())
      if (const auto arrow = kArrows.find(text[end]); arrow != kArrows.end()) {
        event.key = arrow->second;
        events.push_back(event);
      }
    at = std::min(end + 1, text.size());
  }
  text.erase(0, at);
  return events;
}

}  // namespace sim::cli
