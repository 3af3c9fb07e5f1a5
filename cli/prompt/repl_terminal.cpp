#include "cli/prompt/repl_terminal.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <utility>

#include "cli/terminal/signals.h"

#if defined(SIM_READLINE)
#include <readline/history.h>
#include <readline/readline.h>
#elif defined(SIM_EDITLINE)
#include <editline/readline.h>
#endif

namespace sim::cli {

std::string history_file() {
  namespace fs = std::filesystem;
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (state && *state == '/')
    folder = state;
  else if (home && *home == '/')
    folder = fs::path(home) / ".local/state";
  else
    return "";
  folder /= "sim";
  std::error_code failed;
  fs::create_directories(folder, failed);
  return failed ? "" : (folder / "history").string();
}

#if defined(SIM_READLINE) || defined(SIM_EDITLINE)
namespace {

constexpr int kMostEntries = 10000;
constexpr const char* kLuaBreaks = " \t\n\"'`@$><=;|&{(,+-*/^%#~[])}";
constexpr const char* kCommandBreaks = " \t\n\"'";

// readline calls plain functions, so what they need stands here.
struct Editing {
  LineEditor::Completer completer;
  std::string line;
  bool done = false, ended = false;
  bool continues = false;
  bool abandoned = false;             // by a signal
  std::size_t prompt = 0;             // bytes
  const sigset_t* signals = nullptr;  // that come through while we wait for a key
} editing;

volatile std::sig_atomic_t resized = 0, resumed = 0;

extern "C" void remember_resize(int) { resized = 1; }
extern "C" void remember_resume(int) { resumed = 1; }

void accept(char* text) {
  editing.done = true;
  editing.ended = text == nullptr;
  if (text) editing.line = text;
  std::free(text);
#if !defined(SIM_READLINE)
  rl_callback_handler_remove();
#endif
}

bool in_command() {
  const std::string_view line(rl_line_buffer);
  const std::size_t start = line.find_first_not_of(' ');
  return start != std::string_view::npos && line[start] == '.';
}

std::vector<std::string> found_words;

char* next_word(const char* /*text*/, int state) {
  static std::size_t next = 0;
  if (state == 0) next = 0;
  return next < found_words.size() ? strdup(found_words[next++].c_str()) : nullptr;
}

char** attempt(const char* text, int start, int /*end*/) {
#if defined(SIM_READLINE)
  if (rl_completion_quote_character) return nullptr;  // files
#endif
  rl_attempted_completion_over = 1;
  Completions found;
  try {
    const auto begin = static_cast<std::size_t>(start);
    found = editing.completer(std::string(rl_line_buffer, begin) + text, begin);
  } catch (const std::exception&) {
    return nullptr;
  }
  found_words = std::move(found.words);
  if (found_words.empty() && found.files) rl_attempted_completion_over = 0;
  rl_completion_append_character = in_command() ? ' ' : '\0';
  return rl_completion_matches(text, next_word);
}

#if defined(SIM_READLINE)
char* word_breaks() { return const_cast<char*>(in_command() ? kCommandBreaks : kLuaBreaks); }

// Tab indents at the front of a line that goes on.
int tab(int count, int key) {
  const std::string_view before(rl_line_buffer, static_cast<std::size_t>(rl_point));
  if (!editing.continues || before.find_first_not_of(' ') != std::string_view::npos)
    return rl_complete(count, key);
  return rl_insert_text("  ");
}
#endif

#if defined(SIM_READLINE)
// readline divides by widths that are too small, and writes beyond its lines where a prompt does
// not fit: it is told of a terminal that is wide enough, and the terminal breaks the lines.
void fit_terminal(std::size_t prompt) {
  winsize size{};
  if (::ioctl(STDIN_FILENO, TIOCGWINSZ, &size) != 0) return;
  const int rows = size.ws_row > 1 ? size.ws_row : 24, columns = size.ws_col > 0 ? size.ws_col : 80;
  const int least = static_cast<int>(std::min<std::size_t>(prompt, 200)) + 20;
  rl_set_screen_size(rows, std::max(columns, least));
}
#endif

void watch(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

// The signals wait while readline works, and come through while we wait for a key.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t ours;
    sigemptyset(&ours);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGWINCH, SIGCONT}) sigaddset(&ours, signal);
    sigprocmask(SIG_BLOCK, &ours, &before_);
  }
  ~SignalsBlocked() { sigprocmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

  const sigset_t& before() const { return before_; }

 private:
  sigset_t before_;
};

void say_to_terminal(const char* text) {
  std::FILE* const out = rl_outstream ? rl_outstream : stdout;
  std::fputs(text, out);
  std::fflush(out);
}

#if defined(SIM_READLINE)
// Waits for a key, and meanwhile for signals: one of them ends the line. (readline's interface of
// callbacks loses its place in key sequences and macros.)
int next_key(std::FILE* stream) {
  for (;;) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    const int ready = SessionSignals::any() ? 0 : ::ppoll(&input, 1, nullptr, editing.signals);
    if (SessionSignals::any()) {
      if (!std::exchange(editing.abandoned, true)) say_to_terminal("^C");
      return EOF;
    }
    if (resumed) rl_prep_terminal(1);
    if (resized) fit_terminal(editing.prompt);
    if (resized || resumed) rl_forced_update_display();
    resized = 0;
    resumed = 0;
    if (ready > 0) return rl_getc(stream);
  }
}
#endif

}  // namespace

LineEditor::LineEditor(std::string history_file, Completer completer)
    : history_file_(std::move(history_file)) {
  editing.completer = std::move(completer);
  rl_readline_name = const_cast<char*>("simrepl");
  rl_attempted_completion_function = attempt;
#if defined(SIM_READLINE)
  rl_getc_function = next_key;
  rl_catch_signals = 0;
  rl_catch_sigwinch = 0;
  rl_basic_word_break_characters = kLuaBreaks;
  rl_completer_quote_characters = "\"'";
  rl_completion_word_break_hook = word_breaks;
  rl_outstream = ::isatty(STDOUT_FILENO) ? stdout : stderr;
  rl_bind_key('\t', tab);
  // Easily typed by mistake, and its search for words has no end in bytes that are no text.
  rl_unbind_function_in_map(rl_vi_editing_mode, emacs_meta_keymap);
  rl_variable_bind("show-all-if-ambiguous", "on");
  history_write_timestamps = 1;
  history_comment_char = '#';
#else
  rl_completer_word_break_characters = const_cast<char*>(kLuaBreaks);
#endif
  watch(SIGWINCH, remember_resize);
  watch(SIGCONT, remember_resume);
  using_history();
  stifle_history(kMostEntries);
  if (history_file_.empty()) return;
  const int file = ::open(history_file_.c_str(), O_CREAT | O_APPEND | O_WRONLY | O_CLOEXEC, 0600);
  if (file < 0) {
    history_file_.clear();
    return;
  }
  ::close(file);
  read_history(history_file_.c_str());
}

LineEditor::~LineEditor() {
#if !defined(SIM_READLINE)
  rl_callback_handler_remove();
#endif
  if (!history_file_.empty()) history_truncate_file(history_file_.c_str(), kMostEntries);
  watch(SIGWINCH, SIG_DFL);
  watch(SIGCONT, SIG_DFL);
}

std::optional<std::string> LineEditor::read(const std::string& prompt) {
  editing.done = editing.abandoned = false;
  editing.continues = prompt.starts_with("...");
  const SignalsBlocked blocked;
#if defined(SIM_READLINE)
  editing.prompt = prompt.size();
  editing.signals = &blocked.before();
  rl_initialize();
  fit_terminal(prompt.size());
  // What was undone in lines of the history is forgotten: its memory may have been freed.
  for (HIST_ENTRY** entry = history_list(); entry && *entry; ++entry) (*entry)->data = nullptr;
  accept(::readline(prompt.c_str()));
  if (SessionSignals::any()) {
    if (!editing.abandoned) say_to_terminal("^C");
    if (editing.ended || !editing.abandoned) say_to_terminal("\n");
    throw Interrupted();
  }
#else
  rl_callback_handler_install(prompt.c_str(), accept);
  while (!editing.done) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    const int ready = SessionSignals::any() ? 0 : ::ppoll(&input, 1, nullptr, &blocked.before());
    if (SessionSignals::any()) {
      say_to_terminal("^C\n");
      rl_callback_handler_remove();
      throw Interrupted();
    }
    resized = 0;
    resumed = 0;
    if (ready > 0) rl_callback_read_char();
  }
#endif
  if (editing.ended) return {};
  return editing.line;
}

void LineEditor::remember(const std::string& text) {
  if (text.find_first_not_of(" \t\n") == std::string::npos || text == last_) return;
  last_ = text;
  add_history(text.c_str());
#if defined(SIM_READLINE)
  if (!history_file_.empty()) append_history(1, history_file_.c_str());
#else
  if (!history_file_.empty()) write_history(history_file_.c_str());
#endif
}

#else  // neither library: lines as the terminal gives them

LineEditor::LineEditor(std::string history_file, Completer /*completer*/)
    : history_file_(std::move(history_file)) {}
LineEditor::~LineEditor() = default;

std::optional<std::string> LineEditor::read(const std::string& prompt) {
  std::cout << prompt << std::flush;
  std::string line;
  if (std::getline(std::cin, line)) return line;
  if (!SessionSignals::any()) return {};
  std::cin.clear();
  std::clearerr(stdin);
  std::cout << "^C\n";
  throw Interrupted();
}

void LineEditor::remember(const std::string& /*text*/) {}

#endif

}  // namespace sim::cli
