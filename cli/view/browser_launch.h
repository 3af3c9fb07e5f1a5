// Opens the live page in the user's browser. The address holds the token, and every user of a
// machine can read the arguments of a process: the browser is given a private file that leads on.
#pragma once

#include <chrono>
#include <string>

namespace sim::cli {

// The file exists for a minute, or as long as this.
class BrowserLaunch {
 public:
  BrowserLaunch() = default;
  ~BrowserLaunch() { remove_file(); }
  BrowserLaunch(const BrowserLaunch&) = delete;
  BrowserLaunch& operator=(const BrowserLaunch&) = delete;

  // Opens a browser if there is a screen. Throws Error{kIo} if the file cannot be written.
  void open(const std::string& address);
  void remove_when_old();

 private:
  void write_file(const std::string& text);
  void remove_file();

  std::string folder_, file_;  // the folder, if it was made for the file
  std::chrono::steady_clock::time_point opened_;
};

}  // namespace sim::cli
