// Random bytes at the prompt, while the terminal changes its size.
#include <catch2/catch.hpp>

#include <pty.h>
#include <sys/ioctl.h>

#include <random>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

// The exit status of the program after the bytes, and SIGTERM, as a shell reports it.
int end_after_bytes(unsigned seed, const std::string& folder) {
  std::minstd_rand random(seed);
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  REQUIRE(child >= 0);
  if (child == 0) {
    setenv("XDG_STATE_HOME", folder.c_str(), 1);
    setenv("TERM", "xterm", 1);
    execl(SIM_REPL_BINARY, SIM_REPL_BINARY, "--init", "none", nullptr);
    _exit(126);
  }
  fcntl(terminal, F_SETFL, O_NONBLOCK);
  const std::string words[] = {".step 3\r", "\x1b[A",    "\x1b[B",    "\t",   "\x12",
                               "\x19",      "\x16",      "\x1f",      "\x18", "\x1b.",
                               "x = 1\r",   "\x1b[1;5C", "aaaaaaaaaa"};
  const unsigned short widths[] = {0, 1, 2, 3, 5, 8, 13, 80, 300};
  const auto drain = [&](int milliseconds) {
    pollfd output{terminal, POLLIN, 0};
    char bytes[4096];
    while (poll(&output, 1, milliseconds) > 0 && read(terminal, bytes, sizeof bytes) > 0) {}
  };
  drain(200);
  for (int i = 0; i < 1500; ++i) {
    if (i % 10 == 0) {
      const winsize size{static_cast<unsigned short>(random() % 3),
                         widths[random() % std::size(widths)], 0, 0};
      ioctl(terminal, TIOCSWINSZ, &size);
    }
    std::string bytes = words[random() % std::size(words)];
    if (random() % 2)
      for (char& byte : bytes = std::string(1 + random() % 20, 'x'))
        byte = static_cast<char>(random());
    std::erase_if(bytes, [](char c) {  // signals, the end, and what stops the terminal
      return c == 3 || c == 4 || c == 17 || c == 19 || c == 26 || c == 28;
    });
    for (int tries = 0; tries < 100 && !bytes.empty(); ++tries) {
      const ssize_t count = write(terminal, bytes.data(), bytes.size());
      if (count > 0) bytes.erase(0, static_cast<std::size_t>(count));
      if (count < 0 && errno != EAGAIN) break;
      drain(count < 0 ? 20 : 0);
    }
    drain(0);
  }
  kill(child, SIGTERM);
  int status = 0;
  for (int i = 0; i < 600 && waitpid(child, &status, WNOHANG) == 0; ++i) {
    drain(100);
    if (i == 580) kill(child, SIGKILL);
  }
  close(terminal);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

TEST_CASE("the prompt bears any bytes at any width", "[repl]") {
  const TemporaryFolder folder;
  for (const unsigned seed : {1u, 2u, 3u}) {
    const int code = end_after_bytes(seed, folder.path().string());
    INFO("seed " << seed << ", exit " << code);
    CHECK((code == 143 || code == 0));  // the bytes may say that they are all
  }
}
