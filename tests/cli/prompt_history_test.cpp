// The history of prompts in a file: entries of earlier sessions, and how many are kept.
#include "cli/prompt/prompt_history.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using sim::cli::PromptHistory;
using sim_test::read_text;
using sim_test::write_text;

namespace {

using Entries = std::vector<std::string>;

std::string lines_to(std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += "#17\n" + std::to_string(i) + "\n";
  return text;
}

}  // namespace

TEST_CASE("a history keeps the newest 10000 entries") {
  const sim_test::TemporaryFolder folder;
  const std::string file = folder.path() / "history";
  for (const std::size_t count : {9999, 10000, 10001, 10300}) {
    CAPTURE(count);
    write_text(file, lines_to(count));
    const std::size_t cut = count > 10000 ? count - 10000 : 0;
    {
      PromptHistory history(file);
      CHECK(history.entries().size() == count - cut);
      CHECK(history.entries().front() == std::to_string(cut));
      history.add("last");
      CHECK(history.entries().back() == "last");
      CHECK(read_text(file).ends_with("\nlast\n"));  // at once
    }
    const PromptHistory again(file);
    const std::size_t kept = std::min<std::size_t>(count + 1, 10000);
    CHECK(again.entries().size() == kept);
    CHECK(again.entries().front() == std::to_string(count + 1 - kept));
    CHECK(again.entries().back() == "last");
    std::filesystem::remove(file);
  }
}

TEST_CASE(
    "entries of several lines stay together, and lines of a file without times are one each") {
  const sim_test::TemporaryFolder folder;
  const std::string file = folder.path() / "history";
  write_text(file, "old\nolder\n#1700000000\nboth = {\n5 }\n#170000000x\n#1700000001\nlast\n");
  CHECK(PromptHistory(file).entries() ==
        Entries{"old", "older", "both = {\n5 }\n#170000000x", "last"});
  PromptHistory(file).add("two\nlines");
  CHECK(PromptHistory(file).entries().back() == "two\nlines");
}

TEST_CASE("a history that has no file lives as long as its session") {
  const sim_test::TemporaryFolder folder;
  for (const auto& file : {std::string(), (folder.path() / "no" / "folder").string()}) {
    PromptHistory history(file);
    CHECK(history.entries().empty());
    history.add("one");
    CHECK(history.entries() == Entries{"one"});
  }
  CHECK(std::filesystem::is_empty(folder.path()));
  // A new one is its user's alone.
  const std::string file = folder.path() / "history";
  PromptHistory(file).add("secret");
  CHECK(std::filesystem::status(file).permissions() ==
        (std::filesystem::perms::owner_read | std::filesystem::perms::owner_write));
}
