// A program in a terminal of its own: one that says all it is told (by default a plain one), and
// one of tmux, whose screen can be looked at.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/cli/program.h"

namespace sim_test {

class PlainTerminal {
 public:
  PlainTerminal(const std::string& program, const std::vector<std::string>& arguments,
                const std::string& state_folder, const char* kind = "dumb",
                const winsize& size = {40, 500, 0, 0}) {
    child_ = forkpty(&terminal_, nullptr, nullptr, &size);
    if (child_ < 0) throw std::runtime_error("no terminal");
    if (child_ == 0) {
      setenv("TERM", kind, 1);
      setenv("XDG_STATE_HOME", state_folder.c_str(), 1);
      setenv("EDITRC", "/dev/null", 1);
      std::vector<char*> argv{const_cast<char*>(program.c_str())};
      for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str()));
      argv.push_back(nullptr);
      execv(program.c_str(), argv.data());
      _exit(126);
    }
    fcntl(terminal_, F_SETFL, O_NONBLOCK);
  }
  ~PlainTerminal() {
    if (terminal_ >= 0) close(terminal_);
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }
  PlainTerminal(const PlainTerminal&) = delete;
  PlainTerminal& operator=(const PlainTerminal&) = delete;

  void resize(const winsize& size) { ioctl(terminal_, TIOCSWINSZ, &size); }

  // Reads while it types, and stops where the program takes nothing for 2 s.
  void type(std::string_view text) {
    pollfd ready{terminal_, POLLIN | POLLOUT, 0};
    while (!text.empty() && poll(&ready, 1, 2000) > 0) {
      if (ready.revents & POLLIN) take();
      const ssize_t count =
          ready.revents & POLLOUT ? write(terminal_, text.data(), text.size()) : 0;
      if (count > 0) text.remove_prefix(static_cast<std::size_t>(count));
      if ((count < 0 && errno != EAGAIN) || ready.revents == POLLHUP) break;
    }
  }

  // The output since the last call, up to `end`; without carriage returns. Gives up after 90 s.
  std::string wait_for(const std::string& end) {
    const auto late = std::chrono::steady_clock::now() + std::chrono::seconds(90);
    while (!text_.ends_with(end)) {
      pollfd ready{terminal_, POLLIN, 0};
      poll(&ready, 1, 100);
      if (ready.revents && !take()) break;
      if (std::chrono::steady_clock::now() > late) break;
    }
    return std::exchange(text_, {});
  }

  // The exit status after SIGTERM, as a shell reports it; SIGKILL follows after 30 s.
  int end() {
    kill(child_, SIGTERM);
    int status = 0;
    for (int i = 0; waitpid(child_, &status, WNOHANG) == 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      while (take()) {}
      if (i == 3000) kill(child_, SIGKILL);
    }
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  bool take() {
    char piece[4096];
    const ssize_t count = read(terminal_, piece, sizeof piece);
    for (ssize_t i = 0; i < count; ++i)
      if (piece[i] != '\r') text_ += piece[i];
    return count > 0;
  }

  int terminal_ = -1;
  pid_t child_ = -1;
  std::string text_;
};

class Tmux {
 public:
  Tmux(const std::string& command, const std::filesystem::path& socket) : socket_(socket.string()) {
    run({"-f", "/dev/null", "new-session", "-d", "-s", "s", "-x", "100", "-y", "40", command});
  }
  ~Tmux() { run({"kill-server"}); }
  Tmux(const Tmux&) = delete;
  Tmux& operator=(const Tmux&) = delete;

  void key(const std::string& name) { run({"send-keys", "-t", "s", name}); }
  void type(const std::string& text) { run({"send-keys", "-t", "s", "-l", text}); }
  void enter(const std::string& line) {
    type(line);
    key("Enter");
  }
  void paste(const std::string& text) {
    run({"set-buffer", text});
    run({"paste-buffer", "-p", "-t", "s"});
  }

  std::string screen() { return run({"capture-pane", "-t", "s", "-p"}); }

  // True once the screen shows the text; gives up after 20 s.
  bool shows(const std::string& text) {
    for (int i = 0; i < 400; ++i) {
      if (screen().find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return false;
  }

 private:
  std::string run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"-S", socket_});
    return run_sim(arguments, {.program = "/usr/bin/tmux",
                               .environment = {{"LC_ALL", "C.UTF-8"}, {"TERM", "xterm"}}})
        .out;
  }

  std::string socket_;
};

}  // namespace sim_test
