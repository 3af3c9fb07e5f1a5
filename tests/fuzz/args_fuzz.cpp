// A command line: one word a line, of `sim` and of `simrepl`.
#include <string>
#include <vector>

#include "cli/command_line/options.h"
#include "cli/command_line/repl_options.h"
#include "core/base/error.h"
#include "tests/fuzz/fuzz.h"

void sim_fuzz::fuzz(std::string_view bytes) {
  std::vector<std::string> words{"sim"};
  std::string word;
  for (const char c : bytes) {
    if (c == '\0') continue;  // which no word has
    if (c != '\n') {
      word += c;
      continue;
    }
    words.push_back(word);
    word.clear();
  }
  words.push_back(word);
  std::vector<const char*> arguments;
  for (const std::string& each : words) arguments.push_back(each.c_str());
  const int count = static_cast<int>(arguments.size());
  arguments.push_back(nullptr);
  try {
    sim::cli::parse_repl_command_line(count, arguments.data());
  } catch (const sim::Error& error) {
    if (error.kind() == sim::ErrorKind::kInternal) throw;
  }
  sim::cli::parse_command_line(count, arguments.data(), {});
}
