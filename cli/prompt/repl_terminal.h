// Lines from a terminal: edited with readline (or libedit, or not at all), kept between sessions.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "cli/prompt/repl_help.h"

namespace sim::cli {

// One at a time, for readline has one state.
class LineEditor {
 public:
  using Completer = std::function<Completions(const std::string& line, std::size_t word_begin)>;

  // The history is read from `history_file`, and lines are added to it as they come; without a
  // name, or where it cannot be written, they are forgotten.
  LineEditor(std::string history_file, Completer completer);
  ~LineEditor();
  LineEditor(const LineEditor&) = delete;
  LineEditor& operator=(const LineEditor&) = delete;

  // What was typed, without the last newline; pasted text may hold newlines. Nothing at the end of
  // the input. Throws Interrupted, with the line cleared, when a signal arrives.
  std::optional<std::string> read(const std::string& prompt);

  void remember(const std::string& text);

 private:
  std::string history_file_, last_;
};

// $XDG_STATE_HOME/sim/history, with its folders made; "" where there is no home.
std::string history_file();

}  // namespace sim::cli
