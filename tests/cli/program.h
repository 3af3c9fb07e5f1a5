// Runs the real program as a child, without a shell, and takes what it says.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace sim_test {

struct Outcome {
  int code = -1;  // exit code; 128 + signal when a signal ended it
  std::string out, err;
};

struct ProgramOptions {
  std::string program = SIM_BINARY;
  std::string input{};             // on standard input
  std::filesystem::path folder{};  // to start in; empty = here
  std::vector<std::pair<std::string, std::string>> environment{};
  std::size_t close_after = 0;  // stop reading standard output after that many bytes; 0 = never
  int signal = 0;               // sent when standard output or error says `signal_at`
  std::string signal_at{};
  bool without_err = false;  // standard error is closed
};

namespace program_detail {

// A file without a name that holds the text.
inline int input_of(const std::string& text) {
  const int file = memfd_create("input", MFD_CLOEXEC);
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = write(file, text.data() + done, text.size() - done);
    if (count <= 0) throw std::runtime_error("no input");
    done += static_cast<std::size_t>(count);
  }
  lseek(file, 0, SEEK_SET);
  return file;
}

[[noreturn]] inline void become(const std::vector<std::string>& arguments,
                                const ProgramOptions& options, int in, int out, int err) {
  std::vector<char*> argv{const_cast<char*>(options.program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  dup2(in, 0);
  dup2(out, 1);
  dup2(err, 2);
  if (options.without_err) close(2);
  unsetenv("SIM_PATH");
  unsetenv("SIM_PLUGIN_PATH");
  setenv("XDG_DATA_HOME", "/nonexistent", 1);  // not the plugins of whoever runs the tests
  for (const auto& [name, value] : options.environment) setenv(name.c_str(), value.c_str(), 1);
  signal(SIGPIPE, SIG_DFL);
  if (!options.folder.empty() && chdir(options.folder.c_str()) != 0) _exit(125);
  execv(options.program.c_str(), argv.data());
  _exit(126);
}

}  // namespace program_detail

// A child that is not done after three minutes is killed, which shows as code 137.
inline Outcome run_sim(const std::vector<std::string>& arguments,
                       const ProgramOptions& options = {}) {
  int out[2], err[2];
  if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const int in = program_detail::input_of(options.input);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no child");
  if (child == 0) program_detail::become(arguments, options, in, out[1], err[1]);
  close(in);
  close(out[1]);
  close(err[1]);

  Outcome outcome;
  bool signalled = options.signal == 0;
  pollfd ends[2] = {{out[0], POLLIN, 0}, {err[0], POLLIN, 0}};
  const auto late = std::chrono::steady_clock::now() + std::chrono::minutes(3);
  while (ends[0].fd >= 0 || ends[1].fd >= 0) {
    poll(ends, 2, 200);
    if (std::chrono::steady_clock::now() > late) kill(child, SIGKILL);
    for (int i = 0; i < 2; ++i) {
      if (ends[i].fd < 0 || ends[i].revents == 0) continue;
      std::string& text = i == 0 ? outcome.out : outcome.err;
      char piece[65536];
      const ssize_t count = read(ends[i].fd, piece, sizeof piece);
      if (count > 0) text.append(piece, static_cast<std::size_t>(count));
      const bool enough = i == 0 && options.close_after > 0 && text.size() >= options.close_after;
      if (count <= 0 || enough) {
        close(ends[i].fd);
        ends[i].fd = -1;
      }
      if (!signalled && text.find(options.signal_at) != std::string::npos) {
        kill(child, options.signal);
        signalled = true;
      }
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return outcome;
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

inline std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  if (!stream.flush()) throw std::runtime_error("cannot write " + file.string());
}

inline std::size_t files_in(const std::filesystem::path& folder) {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
  return count;
}

}  // namespace sim_test
