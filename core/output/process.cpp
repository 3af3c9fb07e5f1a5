#include "core/output/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/system_failure.h"
#include "core/output/file_plan.h"
#include "core/output/output.h"

namespace sim {
namespace {

[[noreturn]] void fail_process(const std::string& what, const std::string& name, int error) {
  throw Error(ErrorKind::kIo, {what, name, std::strerror(error), remedy_for_writing(error)});
}

void wait_for(pid_t child, int& status) {
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR) break;
}

// Our environment and, of the additions, what it lacks.
std::vector<char*> environment_with(const std::vector<std::string>& additions) {
  std::vector<char*> all;
  for (char** entry = environ; *entry; ++entry) all.push_back(*entry);
  for (const std::string& each : additions)
    if (!std::getenv(each.substr(0, each.find('=')).c_str()))
      all.push_back(const_cast<char*>(each.c_str()));
  all.push_back(nullptr);
  return all;
}

}  // namespace

std::string find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::string_view rest = path ? path : "";
  while (!rest.empty()) {
    const std::string folder(rest.substr(0, rest.find(':')));
    rest.remove_prefix(folder.size() + (folder.size() < rest.size()));
    if (folder.empty() || folder.front() != '/') continue;  // nothing from where we happen to be
    const std::string file = folder + "/" + name;
    if (::access(file.c_str(), X_OK) == 0 && std::filesystem::is_regular_file(file)) return file;
  }
  return "";
}

Process::Process(const std::vector<std::string>& words, const ProcessPlace& place) {
  int in[2] = {-1, -1};
  if (::pipe2(in, O_CLOEXEC) != 0) fail_process("cannot start", words[0], errno);
  said_ = ::memfd_create("sim-said", MFD_CLOEXEC);
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const std::vector<char*> environment = environment_with(place.environment);
  const pid_t parent = ::getpid();
  child_ = ::fork();
  if (child_ == 0) {
    // Its own group: Ctrl-C is for us, and its file is finished.
    ::setpgid(0, 0);
    const int nothing = ::open("/dev/null", O_WRONLY);
    ::dup2(in[0], 0);
    ::dup2(nothing, 1);
    ::dup2(said_ >= 0 ? said_ : nothing, 2);
    ::signal(SIGPIPE, SIG_DFL);
    ::signal(SIGXFSZ, SIG_DFL);
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(127);
    if (!place.folder.empty() && ::chdir(place.folder.c_str()) != 0) ::_exit(127);
    ::execve(arguments[0], arguments.data(), environment.data());
    ::_exit(127);
  }
  const int error = errno;
  ::close(in[0]);
  in_ = in[1];
  if (child_ < 0) fail_process("cannot start", words[0], error);
}

Process::~Process() {
  if (in_ >= 0) ::close(in_);
  if (child_ > 0) {
    // A program that started others (mpirun) gets some time to end them.
    constexpr int kPatience = 500;  // of 10 ms
    ::kill(-child_, SIGTERM);
    for (int waited = 0; waited < kPatience && !ended(); ++waited) {
      const timespec moment{0, 10'000'000};
      ::nanosleep(&moment, nullptr);
    }
    if (child_ > 0) ::kill(-child_, SIGKILL);
    if (child_ > 0) wait_for(child_, status_);
  }
  if (said_ >= 0) ::close(said_);
}

bool Process::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(in_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

bool Process::ended() {
  if (child_ > 0 && ::waitpid(child_, &status_, WNOHANG) == child_) child_ = -1;
  return child_ < 0;
}

std::string Process::finish() {
  if (in_ >= 0) ::close(in_);
  in_ = -1;
  if (child_ > 0) wait_for(child_, status_);
  child_ = -1;
  if (WIFEXITED(status_) && WEXITSTATUS(status_) == 0) return "";
  char text[400] = {};
  const ssize_t count = said_ >= 0 ? ::pread(said_, text, sizeof text - 1, 0) : 0;
  std::string why(text, count > 0 ? static_cast<std::size_t>(count) : 0);
  // The first line with words: some draw a rule before.
  const auto letter = std::ranges::find_if(
      why, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; });
  const auto at = static_cast<std::size_t>(letter - why.begin());
  if (at == why.size()) return "it failed";
  const std::size_t before = why.rfind('\n', at);
  why.erase(0, before == std::string::npos ? 0 : before + 1);
  return why.substr(0, why.find('\n'));
}

FileBeside::FileBeside(const std::string& file) : name_(file) {
  namespace fs = std::filesystem;
  const fs::path whole = resolved_file(file);
  if (fs::is_directory(whole)) fail_process("cannot write", file, EISDIR);
  if (fs::exists(whole) && ::access(whole.c_str(), W_OK) != 0)
    fail_process("cannot write", file, errno);
  final_ = whole.string();
  collect_leftovers(whole.parent_path());
  fs::path made;
  held_ = open_temporary(whole.parent_path(), whole.extension().string(), made);
  if (held_ < 0) fail_process("cannot write", file, errno);
  temporary_ = made.string();
}

FileBeside::~FileBeside() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  if (held_ >= 0) ::close(held_);
}

void FileBeside::commit() {
  if (::rename(temporary_.c_str(), final_.c_str()) != 0) fail_process("cannot write", name_, errno);
  temporary_.clear();
}

}  // namespace sim
