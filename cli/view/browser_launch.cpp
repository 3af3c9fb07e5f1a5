#include "cli/view/browser_launch.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "core/base/error.h"
#include "core/output/page/markup.h"

namespace sim::cli {
namespace {

constexpr std::chrono::seconds kFileLife{60};

[[noreturn]] void fail(const std::string& file) {
  throw Error(ErrorKind::kIo, {"cannot open the browser", file, std::strerror(errno),
                               "open the address by hand, and say --no-open"});
}

// The user's folder for such files, if there is one that is private.
std::string runtime_folder() {
  const char* const path = std::getenv("XDG_RUNTIME_DIR");
  struct stat info;
  if (!path || path[0] != '/' || ::stat(path, &info) != 0) return "";
  const bool ours = S_ISDIR(info.st_mode) && info.st_uid == ::geteuid();
  return ours && (info.st_mode & 077U) == 0 ? path : "";
}

std::string private_folder() {
  const char* const temporary = std::getenv("TMPDIR");
  std::string path = std::string(temporary && *temporary ? temporary : "/tmp") + "/sim_view_XXXXXX";
  if (!::mkdtemp(path.data())) fail(path);
  return path;
}

void start_browser(const std::string& file) {
  const pid_t child = ::fork();
  if (child != 0) {
    if (child > 0) ::waitpid(child, nullptr, 0);
    return;
  }
  if (::fork() == 0) {
    ::setsid();
    std::freopen("/dev/null", "w", stdout);
    std::freopen("/dev/null", "w", stderr);
    ::execlp("xdg-open", "xdg-open", file.c_str(), nullptr);
  }
  ::_exit(0);
}

}  // namespace

void BrowserLaunch::open(const std::string& address) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return;
  const std::string to = markup_text(address);
  write_file(
      "<!doctype html><meta charset=\"utf-8\"><title>sim view</title>"
      "<meta name=\"referrer\" content=\"no-referrer\">"
      "<meta http-equiv=\"refresh\" content=\"0;url=" +
      to + "\"><a href=\"" + to + "\">sim view</a>\n");
  start_browser(file_);
}

// mkstemp makes a new file of mode 0600, or none.
void BrowserLaunch::write_file(const std::string& text) {
  std::string folder = runtime_folder();
  if (folder.empty()) folder = folder_ = private_folder();
  file_ = folder + "/sim_view_XXXXXX.html";
  const int file = ::mkstemps(file_.data(), 5);
  if (file < 0) {
    const std::string wanted = std::exchange(file_, "");
    fail(wanted);
  }
  opened_ = std::chrono::steady_clock::now();
  const ssize_t written = ::write(file, text.data(), text.size());
  const bool whole = written == static_cast<ssize_t>(text.size());
  if (::close(file) != 0 || !whole) fail(file_);
}

void BrowserLaunch::remove_file() {
  if (!file_.empty()) ::unlink(file_.c_str());
  if (!folder_.empty()) ::rmdir(folder_.c_str());
  file_.clear();
  folder_.clear();
}

void BrowserLaunch::remove_when_old() {
  if (!file_.empty() && std::chrono::steady_clock::now() > opened_ + kFileLife) remove_file();
}

}  // namespace sim::cli
