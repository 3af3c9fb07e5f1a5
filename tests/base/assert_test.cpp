// Invariants where they are checked: in debug builds, fuzzers and under sanitizers.
#ifndef SIM_CHECKED
#define SIM_CHECKED
#endif
#include "core/base/assert.h"

#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <string>

namespace {

struct End {
  int signal = 0, code = -1;
  std::string err;
};

// The end of a child process that does this work.
template <class Work>
End end_of(const Work& work) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::signal(SIGABRT, SIG_DFL);
    dup2(ends[1], 2);
    work();
    _exit(0);
  }
  close(ends[1]);
  End end;
  char text[256];
  for (ssize_t got; (got = read(ends[0], text, sizeof text)) > 0;)
    end.err.append(text, static_cast<std::size_t>(got));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
  if (WIFEXITED(status)) end.code = WEXITSTATUS(status);
  return end;
}

}  // namespace

TEST_CASE("an invariant that does not hold ends the program and says what was assumed") {
  const End broken = end_of([] {
    const int n = 3;
    SIM_ASSERT(n < 3);
  });
  CHECK(broken.signal == SIGABRT);
  CHECK(broken.err.find("sim: assertion failed: n < 3: ") == 0);
  CHECK(broken.err.find("assert_test.cpp:") != std::string::npos);
  const End whole = end_of([] { SIM_ASSERT(2 < 3); });
  CHECK(whole.code == 0);
  CHECK(whole.err.empty());
}
