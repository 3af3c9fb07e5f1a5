#include "core/plugin/probe.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "core/base/error.h"
#include "core/base/system_failure.h"
#include "core/base/text.h"
#include "core/plugin/library.h"
#include "core/plugin/registry.h"

namespace sim {
namespace {

// Makes the plugins that need no more than parameters, or parameters and no elements.
struct Maker final : Registrar {
  void keep(std::shared_ptr<PluginInfo> plugin) override {
    try {
      settle_defaults(plugin->params);
      const Params params(plugin->title(), plugin->params, {}, "", plugin->free_numbers);
      make<Integrator>(*plugin, params);
      make<Force>(*plugin, params, Elements{});
      make<Field>(*plugin, params);
      make<Collider>(*plugin, params);
      make<RigidMotion>(*plugin, params);
      make<ContactLaw>(*plugin, params);
      make<Constraint>(*plugin, params, Elements{});
    } catch (...) {  // an error is no crash
    }
  }
  template <class Object, class... Arguments>
  static void make(const PluginInfo& plugin, const Arguments&... arguments) {
    if (plugin.kind != kind_of<Object>) return;
    const auto& made = static_cast<const Plugin<Object>&>(plugin).make;
    if (made) made(arguments...);
  }
};

[[noreturn]] void be_child(const std::function<void()>& work) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGINT, SIGTERM, SIGHUP})
    std::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const int nowhere = ::open("/dev/null", O_WRONLY);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  try {
    work();
  } catch (...) {}
  ::_exit(0);
}

[[noreturn]] void fail_to_start(int error) {
  throw Error(ErrorKind::kIo, {"cannot start a process to try a plugin in", "", strerror(error),
                               remedy_for(error)});
}

}  // namespace

// The child holds the write end of a pipe, which is closed when it ends in any way.
std::string tried_by_child(const std::function<void()>& work, double seconds) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) fail_to_start(errno);
  const pid_t child = ::fork();
  const int error = errno;
  if (child == 0) be_child(work);
  ::close(ends[1]);
  if (child < 0) {
    ::close(ends[0]);
    fail_to_start(error);
  }
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  pollfd pipe{ends[0], POLLIN, 0};
  bool ended = false;
  while (!ended && Clock::now() < end) {
    const std::chrono::duration<double, std::milli> left = end - Clock::now();
    ended = ::poll(&pipe, 1, static_cast<int>(std::max(1.0, left.count()))) > 0;
  }
  ::close(ends[0]);
  if (!ended) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {}
  if (!ended) return "it does not end in " + shortest(seconds) + " s";
  if (WIFSIGNALED(status))
    return "it crashes: signal " + std::to_string(WTERMSIG(status)) + " (" +
           strsignal(WTERMSIG(status)) + ")";
  return WEXITSTATUS(status) == 0 ? "" : "it ends the process that opens it";
}

void probe_library(const std::filesystem::path& file) {
  const std::string why = tried_by_child([&] {
    Maker maker;
    open_library(file, maker);
  });
  if (why.empty()) return;
  throw Error(ErrorKind::kPlugin, {"plugin", file.string(), why + " when it is opened",
                                   "it was tried in a process of its own; mend it"});
}

}  // namespace sim
