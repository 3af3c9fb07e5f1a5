#include "core/output/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "core/base/error.h"
#include "core/output/output.h"

namespace sim {
namespace {

[[noreturn]] void fail_process(const std::string& what, const std::string& name, int error) {
  throw Error(ErrorKind::kIo, {what, name, std::strerror(error),
                               "check the folder, its permissions and the space there"});
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

Process::Process(const std::vector<std::string>& words) {
  int in[2] = {-1, -1};
  if (::pipe2(in, O_CLOEXEC) != 0) fail_process("cannot start", words[0], errno);
  std::string name = std::filesystem::temp_directory_path() / "sim-said-XXXXXX";
  said_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (said_ >= 0) ::unlink(name.c_str());
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  child_ = ::fork();
  if (child_ == 0) {
    // Its own group: Ctrl-C is for us, and its file is finished.
    ::setpgid(0, 0);
    const int nothing = ::open("/dev/null", O_WRONLY);
    ::dup2(in[0], 0);
    ::dup2(nothing, 1);
    ::dup2(said_ >= 0 ? said_ : nothing, 2);
    ::signal(SIGPIPE, SIG_DFL);
    ::execv(arguments[0], arguments.data());
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
    ::kill(child_, SIGTERM);
    while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {}
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

std::string Process::finish() {
  ::close(in_);
  in_ = -1;
  int status = 0;
  while (::waitpid(child_, &status, 0) < 0)
    if (errno != EINTR) break;
  child_ = -1;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  char text[400] = {};
  const ssize_t count = said_ >= 0 ? ::pread(said_, text, sizeof text - 1, 0) : 0;
  std::string why(text, count > 0 ? static_cast<std::size_t>(count) : 0);
  why = why.substr(0, why.find('\n'));
  return why.empty() ? "it failed" : why;
}

FileBeside::FileBeside(const std::string& file) : name_(file) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(file), error);
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
