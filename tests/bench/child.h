// A child process with a pipe to its input and one from its output. Never goes through a shell.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace sim_bench {

class Child {
 public:
  // Runs arguments[0], looked up in PATH; its words (stderr) go to `log`, or where ours go. Throws
  // sim::Error{kIo} when no process can be made; a program that does not exist exits with 127.
  explicit Child(const std::vector<std::string>& arguments, const std::string& log = "");
  ~Child();  // ends the process if it still runs
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // False when the process no longer listens.
  bool write(const std::string& text);
  // The next line without its end; nothing at the end of the output.
  std::optional<std::string> read_line();
  // Closes its input and waits; the exit code, 128 + signal if one ended it.
  int wait();

 private:
  pid_t process_ = -1;
  int to_ = -1, from_ = -1;
  std::string buffer_;
};

}  // namespace sim_bench
