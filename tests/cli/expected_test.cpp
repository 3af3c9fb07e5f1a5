// Whole answers of the programs, word by word, as the texts in tests/cli/expected/ have them.
//
//   $ sim WORDS        a command of sim or simrepl, in a folder of its own; "$ cat FILE" shows a
//   file < LINE             a line of its standard input; "$ write FILE" takes them into a file
//   LINE               of standard output, "! LINE" of standard error, "[exit 2]" where it is not 0
//
// "~" stands for a number that differs from run to run, with the spaces around it. Numbers of seven
// digits and more may differ in the sixth, for compilers round differently in studies. Paths begin
// with SOURCE or PLUGINS.
#include <catch2/catch.hpp>
#include <cmath>
#include <regex>

#include "core/base/text.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

std::string with_names(std::string text) {
  for (const auto& [path, name] :
       {std::pair<std::string, std::string>{SIM_PLUGIN_DIR, "PLUGINS"}, {SIM_SOURCE_DIR, "SOURCE"}})
    for (std::size_t at = 0; (at = text.find(path, at)) != std::string::npos;)
      text.replace(at, path.size(), name);
  return text;
}

// True if a line tells a duration, which depends on the machine.
bool tells_of_time(const std::string& line) {
  return line.starts_with("sim: note: ") &&
         (line.find("Ctrl-C ends it with what it has") != std::string::npos ||
          line.find("Ctrl-C skips it") != std::string::npos ||
          line.find("the run takes about ") != std::string::npos);
}

std::string answer_of(const std::string& command, const std::string& input,
                      const std::filesystem::path& folder) {
  std::vector<std::string> words;
  std::istringstream stream(command);
  for (std::string word; stream >> word;) words.push_back(word);
  const std::string program = words.at(0);
  words.erase(words.begin());
  if (program == "cat") return read_text(folder / words.at(0));
  if (program == "write") {
    write_text(folder / words.at(0), input);
    return "";
  }
  for (std::string& word : words) std::ranges::replace(word, '_', word[0] == '"' ? ' ' : '_');
  for (std::string& word : words) std::erase(word, '"');
  const Outcome outcome =
      run_sim(words, {.program = program == "sim" ? SIM_BINARY : SIM_REPL_BINARY,
                      .input = input,
                      .folder = folder});
  std::string text = outcome.out;
  for (const std::string& line : lines_of(outcome.err))
    if (!tells_of_time(line)) text += "! " + line + '\n';
  if (outcome.code != 0) text += "[exit " + std::to_string(outcome.code) + "]\n";
  return with_names(text);
}

struct Piece {
  std::string text;
  bool number;
};

// Text and numbers in turn; the first and the last are text.
std::vector<Piece> pieces_of(const std::string& line) {
  static const std::regex number(R"(~|[-+]?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?)");
  std::vector<Piece> pieces;
  std::size_t end = 0;
  for (std::sregex_iterator at(line.begin(), line.end(), number), last; at != last; ++at) {
    pieces.push_back({line.substr(end, static_cast<std::size_t>(at->position()) - end), false});
    pieces.push_back({at->str(), true});
    end = static_cast<std::size_t>(at->position() + at->length());
  }
  pieces.push_back({line.substr(end), false});
  return pieces;
}

bool same_number(const std::string& expected, const std::string& got) {
  if (expected == "~" || expected == got) return true;
  const auto digits = [](const std::string& text) {
    return std::ranges::count_if(text.substr(0, text.find_first_of("eE")),
                                 [](char c) { return c >= '0' && c <= '9'; });
  };
  if (digits(expected) < 7 && digits(got) < 7) return false;
  const double x = std::strtod(expected.c_str(), nullptr), y = std::strtod(got.c_str(), nullptr);
  return std::abs(x - y) <= 1e-6 * std::abs(x);
}

bool same_line(const std::string& expected, const std::string& line) {
  std::vector<Piece> ours = pieces_of(expected), theirs = pieces_of(line);
  if (ours.size() != theirs.size()) return false;
  for (std::size_t i = 0; i < ours.size(); ++i)
    if (ours[i].text == "~")
      for (std::vector<Piece>* pieces : {&ours, &theirs}) {
        std::string &before = (*pieces)[i - 1].text, &after = (*pieces)[i + 1].text;
        before.erase(before.find_last_not_of(' ') + 1);
        after.erase(0, std::min(after.find_first_not_of(' '), after.size()));
      }
  return std::ranges::equal(ours, theirs, [](const Piece& a, const Piece& b) {
    return a.number == b.number && (a.number ? same_number(a.text, b.text) : a.text == b.text);
  });
}

void check_text(const std::string& name) {
  const TemporaryFolder folder;
  const auto lines = lines_of(read_text(SIM_SOURCE_DIR "/tests/cli/expected/" + name + ".txt"));
  std::size_t commands = 0, at = 0;
  while (at < lines.size()) {
    const std::string command = lines[at++];
    INFO(command);
    REQUIRE(command.starts_with("$ "));
    std::string input;
    for (; at < lines.size() && lines[at].starts_with("< "); ++at)
      input += lines[at].substr(2) + "\n";
    std::vector<std::string> expected;
    for (; at < lines.size() && !lines[at].starts_with("$ "); ++at) expected.push_back(lines[at]);
    const std::string answer = answer_of(command.substr(2), input, folder.path());
    INFO(answer);
    const auto got = lines_of(answer);
    for (std::size_t i = 0; i < std::min(got.size(), expected.size()); ++i)
      if (!same_line(expected[i], got[i])) {
        CHECK(got[i] == expected[i]);
        break;
      }
    CHECK(got.size() == expected.size());
    ++commands;
  }
  CHECK(commands > 0);
}

}  // namespace

TEST_CASE("list, describe and doctor answer word by word") { check_text("facts"); }
TEST_CASE("reports of runs are word by word what they are") { check_text("runs"); }
TEST_CASE("a run that diverged tells why, word by word") { check_text("postmortem"); }
TEST_CASE("studies answer word by word") { check_text("studies"); }
TEST_CASE("sweeps and their plots are word by word what they are") { check_text("sweeps"); }
TEST_CASE("meshes are imported word by word") { check_text("meshes"); }
TEST_CASE("a session answers word by word") { check_text("session"); }
