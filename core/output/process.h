// A program that is fed through a pipe, and files that such programs write themselves.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>
#include <vector>

namespace sim {

// The path of a program in PATH; "" if there is none.
std::string find_program(const std::string& name);

// The working folder and environment of a program.
struct ProcessPlace {
  std::string folder = {};                    // empty: here
  std::vector<std::string> environment = {};  // NAME=VALUE, where ours has no such name
};

// Runs without a shell: the words are its arguments as they are. Its output is captured. It ends
// when this program does.
class Process {
 public:
  // Throws Error{kIo}.
  explicit Process(const std::vector<std::string>& words, const ProcessPlace& place = {});
  ~Process();  // ends the program and its children if it still runs
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  bool write(std::string_view bytes);  // to its standard input; false: it reads no more
  bool ended();                        // has it? Does not wait
  std::string finish();                // waits for its end; why it failed, "" for success

 private:
  pid_t child_ = -1;  // less than 0: none, or its end was seen
  int in_ = -1, said_ = -1, status_ = 0;
};

// A file that takes its name only when it is complete. Until then it has a temporary name with the
// same ending.
class FileBeside {
 public:
  explicit FileBeside(const std::string& file);  // throws Error{kIo}; makes an empty file
  ~FileBeside();                                 // without commit() it is removed
  FileBeside(const FileBeside&) = delete;
  FileBeside& operator=(const FileBeside&) = delete;

  const std::string& temporary() const { return temporary_; }
  void commit();

 private:
  std::string name_, final_, temporary_;
  int held_ = -1;  // the file, locked: its writer is alive
};

}  // namespace sim
