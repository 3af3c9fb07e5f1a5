#include "cli/prompt/repl_terminal.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <utility>

#include "cli/prompt/file_names.h"
#include "cli/prompt/wide_text.h"
#include "cli/terminal/signals.h"
#include "core/base/utf8.h"

#if defined(SIM_LIBEDIT)
#include <histedit.h>

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <string_view>
#endif

namespace sim::cli {

#if defined(SIM_LIBEDIT)
namespace {

constexpr std::string_view kLuaBreaks = " \t\n\"'`@$><=;|&{(,+-*/^%#~[])}";
constexpr std::string_view kCommandBreaks = " \t\n\"'";
constexpr std::size_t kMostShown = 200;                        // words to choose from
constexpr std::size_t kMostPrompt = 200, kLettersBeside = 20;  // columns
constexpr std::size_t kMostColumns = 8;                        // of a character: a tab
constexpr std::size_t kLeastRows = 1000;
constexpr const wchar_t* kPasteEnd = L"\x1b[201~";

volatile std::sig_atomic_t resized = 0, resumed = 0;

extern "C" void remember_resize(int) { resized = 1; }
extern "C" void remember_resume(int) { resumed = 1; }

void watch(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

// The signals wait while libedit works, and come through while we wait for a key.
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

// Characters are UTF-8 in the whole program; libedit asks the C library.
void choose_characters() {
  const char* const chosen = std::setlocale(LC_CTYPE, "");
  const std::string_view name = chosen ? chosen : "";
  if (!name.ends_with("UTF-8") && !name.ends_with("utf8")) std::setlocale(LC_CTYPE, "C.UTF-8");
}

bool in_command(std::string_view line) {
  const std::size_t start = line.find_first_not_of(' ');
  return start != std::string_view::npos && line[start] == '.';
}

// The quote that is still open at the end of a line; npos if there is none.
std::size_t open_quote(std::string_view line) {
  std::size_t open = std::string_view::npos;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] != '"' && line[i] != '\'') continue;
    if (open == std::string_view::npos)
      open = i;
    else if (line[open] == line[i])
      open = std::string_view::npos;
  }
  return open;
}

std::string common_beginning(const std::vector<std::string>& words) {
  std::string common = words.front();
  for (const std::string& word : words) {
    const auto [end, other] = std::mismatch(common.begin(), common.end(), word.begin(), word.end());
    common.erase(end, common.end());
  }
  return common;
}

}  // namespace

struct LineEditor::Editing {
  Completer completer;
  EditLine* line = nullptr;
  HistoryW* history = nullptr;
  std::FILE* out = nullptr;
  std::wstring prompt;
  bool continues = false, pastes = false;
  std::ptrdiff_t room = -1;           // characters that surely fit into the rows that libedit knows
  const sigset_t* signals = nullptr;  // that come through while we wait for a key
  std::string pending;                // bytes that were read and are no character yet

  explicit Editing(Completer asked);
  ~Editing();

  static Editing& of(EditLine* line) {
    void* self = nullptr;
    el_wget(line, EL_CLIENTDATA, &self);
    return *static_cast<Editing*>(self);
  }

  void add(const std::string& text) const {
    HistEventW event;
    history_w(history, &event, H_ENTER, wide_text(text).c_str());
  }

  void say(const char* text) const {
    std::fputs(text, out);
    std::fflush(out);
  }

  std::size_t columns() const;
  std::size_t length() const;
  void tell_size();
  bool read_byte();
  int read_character(wchar_t* character);
  unsigned char paste();
  unsigned char tab();
  unsigned char offer(const std::string& word, const std::vector<std::string>& words,
                      const std::string& end);
  void show_choice(const std::vector<std::string>& words) const;
};

LineEditor::Editing::Editing(Completer asked) : completer(std::move(asked)) {
  choose_characters();
  out = ::isatty(STDOUT_FILENO) ? stdout : stderr;
  line = el_init("simrepl", stdin, out, stderr);
  el_wset(line, EL_CLIENTDATA, this);
  el_wset(
      line, EL_PROMPT,
      +[](EditLine* called) -> wchar_t* { return Editing::of(called).prompt.data(); });
  el_wset(
      line, EL_GETCFN, +[](EditLine* called, wchar_t* character) -> int {
        return Editing::of(called).read_character(character);
      });
  el_wset(
      line, EL_ADDFN, L"sim-complete", L"completes a name, a command or a file",
      +[](EditLine* called, wint_t) -> unsigned char { return Editing::of(called).tab(); });
  el_wset(
      line, EL_ADDFN, L"sim-paste", L"inserts pasted text",
      +[](EditLine* called, wint_t) -> unsigned char { return Editing::of(called).paste(); });
  el_wset(line, EL_EDITOR, L"emacs");
  constexpr std::pair<const wchar_t*, const wchar_t*> kKeys[] = {
      {L"\t", L"sim-complete"},
      {L"\x1b[200~", L"sim-paste"},
      {L"\x1b[3~", L"ed-delete-next-char"},
      {L"\x1b[H", L"ed-move-to-beg"},
      {L"\x1b[1~", L"ed-move-to-beg"},
      {L"\x1b[F", L"ed-move-to-end"},
      {L"\x1b[4~", L"ed-move-to-end"},
      {L"\x1b[1;5C", L"em-next-word"},
      {L"\x1b[1;5D", L"ed-prev-word"},
      {L"^R", L"em-inc-search-prev"},
      {L"^S", L"em-inc-search-next"},
      {L"^U", L"vi-kill-line-prev"},
      {L"^W", L"ed-delete-prev-word"},
  };
  for (const auto& [keys, function] : kKeys) el_wset(line, EL_BIND, keys, function, nullptr);
  const char* const terminal = std::getenv("TERM");
  pastes = terminal && std::string_view(terminal) != "dumb";
  HistEventW event;
  history = history_winit();
  history_w(history, &event, H_SETSIZE, static_cast<int>(PromptHistory::kMostEntries));
  el_wset(line, EL_HIST, history_w, history);
  el_source(line, nullptr);  // ~/.editrc
}

LineEditor::Editing::~Editing() {
  el_end(line);
  history_wend(history);
}

std::size_t LineEditor::Editing::columns() const {
  winsize size{};
  return ::ioctl(STDIN_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

std::size_t LineEditor::Editing::length() const {
  const LineInfoW* const all = el_wline(line);
  return static_cast<std::size_t>(all->lastchar - all->buffer);
}

// libedit is told of a terminal in which the prompt and some letters fit into one row, and the line
// into the rows (it writes behind its rows otherwise); the real one breaks the line and scrolls.
void LineEditor::Editing::tell_size() {
  const LineInfoW* const all = el_wline(line);
  const std::size_t across =
      std::max(columns(), std::min<std::size_t>(prompt.size(), kMostPrompt) + kLettersBeside);
  std::size_t rows = 1, column = prompt.size();
  for (const wchar_t character : std::wstring_view(all->buffer, length())) {
    column += character >= L' ' && character <= L'~' ? 1 : kMostColumns;
    if (column < across && character != L'\n') continue;
    ++rows;
    column = kMostColumns;
  }
  const std::size_t told = std::max(kLeastRows, 2 * rows);
  room = static_cast<std::ptrdiff_t>(length() + told - rows);
  el_wset(line, EL_SETTC, L"li", std::to_wstring(told).c_str(), nullptr);
  el_wset(line, EL_SETTC, L"co", std::to_wstring(across).c_str(), nullptr);
}

// Waits for a byte, and meanwhile for signals: one of them ends the line.
bool LineEditor::Editing::read_byte() {
  for (;;) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    const int ready = SessionSignals::any() ? 0 : ::ppoll(&input, 1, nullptr, signals);
    if (SessionSignals::any()) return false;
    if (std::exchange(resumed, 0)) {
      el_wset(line, EL_PREP_TERM, 1);
      el_wset(line, EL_REFRESH);
    }
    if (std::exchange(resized, 0)) {
      tell_size();
      el_wset(line, EL_REFRESH);
    }
    if (ready <= 0) continue;
    char byte;
    const ssize_t count = ::read(STDIN_FILENO, &byte, 1);
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count <= 0) return false;
    pending += byte;
    return true;
  }
}

// 1 with the next character; 0 at the end of the input, -1 on a signal. Bytes that are no UTF-8
// become U+FFFD.
int LineEditor::Editing::read_character(wchar_t* character) {
  if (const auto before = room; static_cast<std::ptrdiff_t>(length()) > before) {
    tell_size();
    if (before >= 0) el_wset(line, EL_REFRESH);
  }
  do {
    if (pending.empty() && !read_byte()) return SessionSignals::any() ? -1 : 0;
    while (unfinished_utf8(pending) == pending.size() && read_byte()) {}
    if (SessionSignals::any()) return -1;
    const Character first = first_character(pending);
    *character = static_cast<wchar_t>(first.code.value_or(0xfffd));
    pending.erase(0, first.bytes.size());
  } while (*character == L'\0');  // libedit takes it for the end of its text
  return 1;
}

// Text between the marks of a terminal that says what was pasted: newlines run nothing.
unsigned char LineEditor::Editing::paste() {
  std::wstring text;
  const std::wstring_view end = kPasteEnd;
  while (!text.ends_with(end)) {
    wchar_t character;
    if (el_wgetc(line, &character) != 1) return CC_EOF;
    text += character == L'\r' ? L'\n' : character;
  }
  text.erase(text.size() - end.size());
  return text.empty() || el_winsertstr(line, text.c_str()) == 0 ? CC_REFRESH : CC_ERROR;
}

// Completes the word before the cursor; indents at the front of a line that goes on.
unsigned char LineEditor::Editing::tab() {
  const LineInfoW* const all = el_wline(line);
  const std::string before =
      narrow_text({all->buffer, static_cast<std::size_t>(all->cursor - all->buffer)});
  if (continues && before.find_first_not_of(' ') == std::string::npos)
    return el_winsertstr(line, L"  ") == 0 ? CC_REFRESH : CC_ERROR;
  if (const std::size_t quote = open_quote(before); quote != std::string::npos)
    return offer(before.substr(quote + 1), file_names(before.substr(quote + 1)),
                 before.substr(quote, 1));
  const bool command = in_command(before);
  const std::size_t last = before.find_last_of(command ? kCommandBreaks : kLuaBreaks);
  const std::size_t begin = last == std::string::npos ? 0 : last + 1;
  const std::string word = before.substr(begin);
  Completions found;
  try {
    found = completer(before, begin);
  } catch (const std::exception&) {
    return CC_ERROR;
  }
  if (found.words.empty() && found.files) found.words = file_names(word);
  return offer(word, found.words, command ? " " : "");
}

// Inserts the common beginning of all words, and `end` after a single one that is no folder.
unsigned char LineEditor::Editing::offer(const std::string& word,
                                         const std::vector<std::string>& words,
                                         const std::string& end) {
  if (words.empty()) return CC_ERROR;
  std::string more = common_beginning(words).substr(word.size());
  if (words.size() == 1 && !words.front().ends_with('/')) more += end;
  if (!more.empty()) el_winsertstr(line, wide_text(more).c_str());
  if (words.size() == 1) return CC_REFRESH;
  show_choice(words);
  return CC_REDISPLAY;
}

void LineEditor::Editing::show_choice(const std::vector<std::string>& words) const {
  const std::size_t count = std::min(words.size(), kMostShown);
  std::size_t width = 2;
  for (std::size_t i = 0; i < count; ++i) width = std::max(width, columns_of(words[i]) + 2);
  const std::size_t across = std::max<std::size_t>(columns() / width, 1);
  const std::size_t rows = (count + across - 1) / across;
  std::string text = "\n";
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t i = row; i < count; i += rows)
      text += words[i] + std::string(i + rows < count ? width - columns_of(words[i]) : 0, ' ');
    text += '\n';
  }
  if (count < words.size()) text += "... and " + std::to_string(words.size() - count) + " more\n";
  say(text.c_str());
}

LineEditor::LineEditor(std::string history_file, Completer completer)
    : history_(std::move(history_file)), editing_(new Editing(std::move(completer))) {
  watch(SIGWINCH, remember_resize);
  watch(SIGCONT, remember_resume);
  for (const std::string& entry : history_.entries()) editing_->add(entry);
}

LineEditor::~LineEditor() {
  watch(SIGWINCH, SIG_DFL);
  watch(SIGCONT, SIG_DFL);
}

std::optional<std::string> LineEditor::read(const std::string& prompt) {
  Editing& editing = *editing_;
  editing.prompt = wide_text(prompt);
  editing.continues = prompt.starts_with("...");
  const SignalsBlocked blocked;
  editing.signals = &blocked.before();
  editing.room = -1;  // libedit asks for the size itself before each line
  if (editing.pastes) editing.say("\x1b[?2004h");
  el_wset(editing.line, EL_PREP_TERM, 1);  // before the prompt, so that nothing is echoed twice
  int count = 0;
  const wchar_t* const typed = el_wgets(editing.line, &count);
  if (editing.pastes) editing.say("\x1b[?2004l");
  if (SessionSignals::any()) {
    editing.say("^C\n");
    throw Interrupted();
  }
  if (!typed || count <= 0) return {};
  std::string line = narrow_text({typed, static_cast<std::size_t>(count)});
  if (line.ends_with('\n')) line.pop_back();
  return line;
}

void LineEditor::remember(const std::string& text) {
  if (text.find_first_not_of(" \t\n") == std::string::npos || text == last_) return;
  last_ = text;
  editing_->add(text);
  history_.add(text);
}

#else  // no libedit: lines as the terminal gives them

struct LineEditor::Editing {};

LineEditor::LineEditor(std::string history_file, Completer /*completer*/)
    : history_(std::move(history_file)) {}
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
