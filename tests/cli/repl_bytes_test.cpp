// Random bytes and long lines at the prompt, while the terminal changes its size.
#include <catch2/catch.hpp>

#include <random>

#include "tests/cli/terminal.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

PlainTerminal prompt_of(const winsize& size, const TemporaryFolder& folder) {
  return {SIM_REPL_BINARY, {"--init", "none"}, folder.path().string(), "xterm", size};
}

int end_after_bytes(unsigned seed, const TemporaryFolder& folder) {
  std::minstd_rand random(seed);
  const unsigned short widths[] = {0, 1, 2, 3, 5, 8, 13, 80, 300};
  const auto any_size = [&] {
    return winsize{static_cast<unsigned short>(random() % 3), widths[random() % std::size(widths)],
                   0, 0};
  };
  const std::string words[] = {".step 3\r", "\x1b[A",    "\x1b[B",    "\t",   "\x12",
                               "\x19",      "\x16",      "\x1f",      "\x18", "\x1b.",
                               "x = 1\r",   "\x1b[1;5C", "aaaaaaaaaa"};
  PlainTerminal prompt = prompt_of(any_size(), folder);
  prompt.wait_for("> ");
  for (int i = 0; i < 1500; ++i) {
    if (i % 10 == 0) prompt.resize(any_size());
    std::string bytes = words[random() % std::size(words)];
    if (random() % 2)
      for (char& byte : bytes = std::string(1 + random() % 20, 'x'))
        byte = static_cast<char>(random());
    std::erase_if(bytes, [](char c) {  // signals, the end, and what stops the terminal
      return c == 3 || c == 4 || c == 17 || c == 19 || c == 26 || c == 28;
    });
    prompt.type(bytes);
  }
  return prompt.end();
}

}  // namespace

TEST_CASE("the prompt bears any bytes at any width", "[repl]") {
  const TemporaryFolder folder;
  for (const unsigned seed : {1u, 2u, 3u}) {
    const int code = end_after_bytes(seed, folder);
    INFO("seed " << seed << ", exit " << code);
    CHECK((code == 143 || code == 0));  // the bytes may say that they are all
  }
}

// libedit wrote behind its rows where letters followed at the end of such a line.
TEST_CASE("the prompt bears a line longer than the terminal", "[repl]") {
  const TemporaryFolder folder;
  const auto keys = [](std::size_t letters) {
    return std::string(letters, 'a') + '\x01' + std::string(letters / 3, 'b') + '\x05' +
           std::string(letters / 3, 'c');
  };
  for (const winsize size : {winsize{24, 80, 0, 0}, {3, 40, 0, 0}, {24, 2, 0, 0}})
    for (const std::size_t letters : {60, 180, 2400}) {
      PlainTerminal prompt = prompt_of(size, folder);
      prompt.wait_for("> ");
      prompt.type(keys(letters));
      INFO(size.ws_row << " x " << size.ws_col << ", " << letters << " letters");
      CHECK(prompt.end() == 143);
    }
}
