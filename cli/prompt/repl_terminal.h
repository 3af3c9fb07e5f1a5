// Lines from a terminal: edited with libedit (or as the terminal gives them), kept between
// sessions.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "cli/prompt/prompt_history.h"
#include "cli/prompt/repl_help.h"

namespace sim::cli {

// One instance at a time: signals of the terminal reach the reader.
class LineEditor {
 public:
  using Completer = std::function<Completions(const std::string& line, std::size_t word_begin)>;

  // The history is read from `history_file`, and lines are added to it as they come; without a
  // name, or if it cannot be written, they are lost.
  LineEditor(std::string history_file, Completer completer);
  ~LineEditor();
  LineEditor(const LineEditor&) = delete;
  LineEditor& operator=(const LineEditor&) = delete;

  // The typed text without the last newline; pasted text may hold newlines. Empty at the end of the
  // input. Throws Interrupted, with the line cleared, when a signal arrives.
  std::optional<std::string> read(const std::string& prompt);

  void remember(const std::string& text);

 private:
  struct Editing;  // libedit and its callbacks

  PromptHistory history_;
  std::string last_;
  std::unique_ptr<Editing> editing_;
};

}  // namespace sim::cli
