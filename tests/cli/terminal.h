// A program in a terminal of its own: a plain one (TERM=dumb) that says all it is told, and one of
// tmux, whose screen can be looked at.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/cli/program.h"

namespace sim_test {

class PlainTerminal {
 public:
  PlainTerminal(const std::string& program, const std::vector<std::string>& arguments,
                const std::string& state_folder) {
    winsize size{40, 500, 0, 0};
    child_ = forkpty(&terminal_, nullptr, nullptr, &size);
    if (child_ < 0) throw std::runtime_error("no terminal");
    if (child_ == 0) {
      setenv("TERM", "dumb", 1);
      setenv("XDG_STATE_HOME", state_folder.c_str(), 1);
      setenv("EDITRC", "/dev/null", 1);
      std::vector<char*> argv{const_cast<char*>(program.c_str())};
      for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str()));
      argv.push_back(nullptr);
      execv(program.c_str(), argv.data());
      _exit(126);
    }
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

  void type(const std::string& text) {
    if (write(terminal_, text.data(), text.size()) < 0) throw std::runtime_error("cannot type");
  }

  // The output since the last call, up to `end`; without carriage returns. Gives up after 90 s.
  std::string wait_for(const std::string& end) {
    const auto late = std::chrono::steady_clock::now() + std::chrono::seconds(90);
    while (!text_.ends_with(end)) {
      pollfd ready{terminal_, POLLIN, 0};
      poll(&ready, 1, 100);
      char piece[4096];
      const ssize_t count = ready.revents ? read(terminal_, piece, sizeof piece) : 0;
      if (ready.revents && count <= 0) break;
      for (ssize_t i = 0; i < count; ++i)
        if (piece[i] != '\r') text_ += piece[i];
      if (std::chrono::steady_clock::now() > late) break;
    }
    return std::exchange(text_, {});
  }

 private:
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
