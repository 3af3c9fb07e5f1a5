// The history file of the prompt: a line "#SECONDS" before each entry, which may have several
// lines. GNU readline and bash write the same form.
#pragma once

#include <string>
#include <vector>

namespace sim::cli {

// $XDG_STATE_HOME/sim/history, with its folders made; "" if there is no home.
std::string history_file();

class PromptHistory {
 public:
  static constexpr std::size_t kMostEntries = 10000;

  // Entries of earlier sessions are read from the file, which is made if missing. Without a name,
  // or if it cannot be written, entries are lost with the session.
  explicit PromptHistory(std::string file);
  // A file of more than kMostEntries is cut to the newest.
  ~PromptHistory();
  PromptHistory(const PromptHistory&) = delete;
  PromptHistory& operator=(const PromptHistory&) = delete;

  const std::vector<std::string>& entries() const { return entries_; }  // oldest first

  // Appends to the file at once, so that a session that is killed loses nothing.
  void add(const std::string& text);

 private:
  std::string file_;
  std::vector<std::string> entries_;
};

}  // namespace sim::cli
