// Lines at the prompt of a small scene. It writes files only below its own folder.
#include <algorithm>
#include <sstream>
#include <string>

#include "cli/prompt/repl_session.h"
#include "core/base/error.h"
#include "tests/fuzz/fuzz.h"

void sim_fuzz::fuzz(std::string_view bytes) {
  constexpr std::size_t kMostLines = 20;
  std::string text(bytes);
  std::erase(text, '/');
  std::ostringstream out, err;
  sim::cli::Console console{out, err};
  sim::cli::SessionRequest request;
  request.scene.scene = "scenes/circle.lua";
  request.scene.lua = {.seconds = 2, .memory = std::size_t{64} << 20, .steps = 500'000};
  request.scene.safe = true;
  request.history = std::size_t{1} << 20;
  sim::cli::Session session(request, environment(), registry(), console);
  std::istringstream lines(text);
  std::size_t count = 0;
  for (std::string line; count < kMostLines && !session.exit_code && std::getline(lines, line);
       ++count) {
    // Long runs are no finding.
    if (std::ranges::count_if(line, [](char c) { return c >= '0' && c <= '9'; }) > 6) continue;
    try {
      session.take(line, "fuzz", static_cast<int>(count) + 1);
    } catch (const sim::Error& error) {
      if (error.kind() == sim::ErrorKind::kInternal) throw;
    }
  }
}
